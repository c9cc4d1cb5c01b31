/* The models as bytes; -I says where the repository is. On a word boundary a step is a little faster. */
.macro MODEL name, file
    .global \name, \name\()_end
    .balign 4
\name:
    .incbin "\file"
\name\()_end:
.endm

.section .rodata
MODEL recursive, "models/recursive.bnkf"
MODEL tiny_bnkf, "tests/golden/tiny_bnkf.bnkf"
MODEL tiny_bnkfe, "tests/golden/tiny_bnkfe.bnkf"

.section .note.GNU-stack, "", %progbits
