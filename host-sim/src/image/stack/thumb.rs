//! What Thumb-2 instructions do to the stack pointer, and whom they call.
//!
//! Encodings are those of the ARMv7-M Architecture Reference Manual, chapter A7.

/// What an instruction does to the stack, or to where the program goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Nothing that counts here; what gives bytes back is nothing.
    None,
    /// Takes so many bytes of the stack.
    Takes(u32),
    /// Jumps to an address.
    Goes(u32),
    /// Calls what is at an address.
    Calls(u32),
    /// Goes where a register says.
    GoesByRegister,
    /// Sets the stack pointer to what only a run tells.
    Moves,
}

/// The stack pointer's and the return address's numbers.
const SP: u32 = 13;
const LR: u32 = 14;

/// The effects of the instructions in `code`, which lies at `at`, each with its address.
pub fn effects(code: &[u8], at: u32) -> impl Iterator<Item = (u32, Effect)> {
    let halves: Vec<u32> = code
        .chunks_exact(2)
        .map(|pair| u32::from(u16::from_le_bytes([pair[0], pair[1]])))
        .collect();
    let mut next = 0;
    std::iter::from_fn(move || {
        let first = *halves.get(next)?;
        let at = at.wrapping_add(2 * next as u32);
        next += 1;
        // 0b11101, 0b11110 and 0b11111 begin an instruction of two halves.
        if first < 0xe800 {
            return Some((at, short(first, at)));
        }
        let second = *halves.get(next)?;
        next += 1;
        Some((at, long(first, second, at)))
    })
}

/// `value` of so many bits with its sign.
fn signed(value: u32, bits: u32) -> i32 {
    ((value << (32 - bits)) as i32) >> (32 - bits)
}

/// Where a branch by `offset` from an instruction at `at` goes.
fn target(at: u32, offset: i32) -> u32 {
    at.wrapping_add(4).wrapping_add_signed(offset)
}

fn branch(at: u32, offset: i32) -> Effect {
    Effect::Goes(target(at, offset))
}

fn short(half: u32, at: u32) -> Effect {
    let register = (half >> 3) & 15;
    match half {
        // PUSH
        _ if half & 0xfe00 == 0xb400 => Effect::Takes(4 * (half & 0x1ff).count_ones()),
        // SUB SP, SP, #imm
        _ if half & 0xff80 == 0xb080 => Effect::Takes(4 * (half & 0x7f)),
        // B
        _ if half & 0xf800 == 0xe000 => branch(at, signed(half & 0x7ff, 11) * 2),
        // B<c>; 14 and 15 are UDF and SVC
        _ if half & 0xf000 == 0xd000 && half & 0x0e00 != 0x0e00 => {
            branch(at, signed(half & 0xff, 8) * 2)
        }
        // MOV SP, Rm and ADD SP, Rm
        _ if half & 0xff87 == 0x4685 || half & 0xff87 == 0x4485 => Effect::Moves,
        // BLX Rm, and BX Rm but for a return
        _ if half & 0xff87 == 0x4780 => Effect::GoesByRegister,
        _ if half & 0xff87 == 0x4700 && register != LR => Effect::GoesByRegister,
        _ => Effect::None,
    }
}

fn long(first: u32, second: u32, at: u32) -> Effect {
    let to = (second >> 8) & 15;
    match first {
        // PUSH.W, as STMDB SP!
        0xe92d => Effect::Takes(4 * second.count_ones()),
        // STRD Rt, Rt2, [SP, #-imm]!
        0xe96d => Effect::Takes(4 * (second & 0xff)),
        // STR.W Rt, [SP, #-imm]!
        0xf84d if second & 0x0f00 == 0x0d00 => Effect::Takes(second & 0xff),
        // VPUSH
        _ if first & 0xffbf == 0xed2d && second & 0x0e00 == 0x0a00 => {
            Effect::Takes(4 * (second & 0xff))
        }
        // SUB.W SP, SP, #const
        _ if first & 0xfbff == 0xf1ad && second & 0x8f00 == 0x0d00 => {
            Effect::Takes(expanded(constant(first, second)))
        }
        // SUBW SP, SP, #imm12
        _ if first & 0xfbff == 0xf2ad && second & 0x8f00 == 0x0d00 => {
            Effect::Takes(constant(first, second))
        }
        // ADD.W and ADDW SP, SP, #imm give back.
        _ if first & 0xfbff == 0xf10d || first & 0xfbff == 0xf20d => Effect::None,
        // Other sums, of immediates and of registers, into SP.
        _ if first & 0xf800 == 0xf000 && second & 0x8000 == 0 && to == SP => Effect::Moves,
        _ if first & 0xfe00 == 0xea00 && to == SP => Effect::Moves,
        // BL
        _ if first & 0xf800 == 0xf000 && second & 0xd000 == 0xd000 => {
            Effect::Calls(target(at, far(first, second)))
        }
        // B.W
        _ if first & 0xf800 == 0xf000 && second & 0xd000 == 0x9000 => {
            branch(at, far(first, second))
        }
        // B<c>.W; conditions from 14 on are other instructions.
        _ if first & 0xf800 == 0xf000 && second & 0xd000 == 0x8000 && first & 0x0380 != 0x0380 => {
            let offset = (first & 0x0400) << 10
                | (second & 0x0800) << 8
                | (second & 0x2000) << 5
                | (first & 0x3f) << 12
                | (second & 0x7ff) << 1;
            branch(at, signed(offset, 21))
        }
        // LDR PC
        _ if first & 0xff70 == 0xf850 && second & 0xf000 == 0xf000 && first & 15 != SP => {
            Effect::GoesByRegister
        }
        _ => Effect::None,
    }
}

/// The offset of BL and B.W.
fn far(first: u32, second: u32) -> i32 {
    let sign = (first >> 10) & 1;
    let one = !((second >> 13) ^ sign) & 1;
    let two = !((second >> 11) ^ sign) & 1;
    let offset = sign << 24 | one << 23 | two << 22 | (first & 0x3ff) << 12 | (second & 0x7ff) << 1;
    signed(offset, 25)
}

/// `i:imm3:imm8`
fn constant(first: u32, second: u32) -> u32 {
    (first & 0x0400) << 1 | (second & 0x7000) >> 4 | second & 0xff
}

/// What a modified constant stands for; those that repeat a byte are no size of a frame.
fn expanded(constant: u32) -> u32 {
    if constant < 0x400 {
        constant & 0xff
    } else {
        (0x80 | constant & 0x7f).rotate_right(constant >> 7)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Encodings as GNU's assembler makes them.
    #[test]
    fn encodings_are_the_assemblers() {
        let cases: [(&[u16], Effect); 24] = [
            (&[0xb5f0], Effect::Takes(20)),              // push {r4-r7, lr}
            (&[0xb088], Effect::Takes(32)),              // sub sp, #32
            (&[0xe92d, 0x4ff0], Effect::Takes(36)),      // push.w {r4-r11, lr}
            (&[0xed2d, 0x8b10], Effect::Takes(64)),      // vpush {d8-d15}
            (&[0xed2d, 0x8a01], Effect::Takes(4)),       // vpush {s16}
            (&[0xf84d, 0xbd04], Effect::Takes(4)),       // str.w r11, [sp, #-4]!
            (&[0xe96d, 0x4504], Effect::Takes(16)),      // strd r4, r5, [sp, #-16]!
            (&[0xf5ad, 0x7d1c], Effect::Takes(624)),     // sub.w sp, sp, #624
            (&[0xf2ad, 0x4d04], Effect::Takes(1028)),    // subw sp, sp, #1028
            (&[0xf7ff, 0xfffe], Effect::Calls(0x1000)),  // bl .
            (&[0xf000, 0xf800], Effect::Calls(0x1004)),  // bl .+4
            (&[0xf7ff, 0xbffe], Effect::Goes(0x1000)),   // b.w .
            (&[0xf43f, 0xaffe], Effect::Goes(0x1000)),   // beq.w .
            (&[0xe7fe], Effect::Goes(0x1000)),           // b.n .
            (&[0xd0fe], Effect::Goes(0x1000)),           // beq.n .
            (&[0x4798], Effect::GoesByRegister),         // blx r3
            (&[0x4718], Effect::GoesByRegister),         // bx r3
            (&[0x4770], Effect::None),                   // bx lr
            (&[0x46a5], Effect::Moves),                  // mov sp, r4
            (&[0xebad, 0x0d03], Effect::Moves),          // sub.w sp, sp, r3
            (&[0xea4f, 0x0d03], Effect::Moves),          // mov.w sp, r3
            (&[0xf8d3, 0xf000], Effect::GoesByRegister), // ldr.w pc, [r3]
            (&[0xf10d, 0x0d08], Effect::None),           // add.w sp, sp, #8
            (&[0xb008], Effect::None),                   // add sp, #32
        ];
        for (halves, expected) in cases {
            let code: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
            let got: Vec<_> = effects(&code, 0x1000).collect();
            assert_eq!(got, [(0x1000, expected)], "{halves:04x?}");
        }
    }

    #[test]
    fn half_an_instruction_is_none() {
        assert_eq!(effects(&[0x2d, 0xe9, 0xf0], 0).count(), 0);
    }
}
