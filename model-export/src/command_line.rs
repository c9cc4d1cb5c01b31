//! The command that a result was made by, for its provenance.

/// The command line of this process as a shell would take it, with the program named `program`.
#[must_use]
pub fn command_line(program: &str) -> String {
    let arguments = std::env::args_os().skip(1);
    let quoted = arguments.map(|word| quote(&word.to_string_lossy()));
    std::iter::once(program.to_owned())
        .chain(quoted)
        .collect::<Vec<_>>()
        .join(" ")
}

fn quote(argument: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@".contains(c);
    if !argument.is_empty() && argument.chars().all(plain) {
        argument.to_owned()
    } else {
        format!("'{}'", argument.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::{command_line, quote};

    #[test]
    fn words_are_quoted_where_a_shell_needs_it() {
        assert_eq!(quote("--seed=1"), "--seed=1");
        assert_eq!(quote(""), "''");
        assert_eq!(quote("two words"), "'two words'");
        assert_eq!(quote("it's"), "'it'\\''s'");
        assert!(command_line("program").starts_with("program"));
    }
}
