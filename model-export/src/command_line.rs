//! The command that a result was made by, for its provenance.

/// The command line of this process as a shell would take it, with the program named `program`.
#[must_use]
pub fn command_line(program: &str) -> String {
    command_line_without(program, &[], &[])
}

/// The same without `flags`, and without `options` and their values: what says where the work was done, and not
/// what was done.
#[must_use]
pub fn command_line_without(program: &str, flags: &[&str], options: &[&str]) -> String {
    let arguments = std::env::args_os().skip(1);
    let arguments = arguments.map(|word| word.to_string_lossy().into_owned());
    let quoted = without(arguments, flags, options).map(|word| quote(&word));
    std::iter::once(program.to_owned())
        .chain(quoted)
        .collect::<Vec<_>>()
        .join(" ")
}

fn without(
    arguments: impl Iterator<Item = String>,
    flags: &[&str],
    options: &[&str],
) -> impl Iterator<Item = String> {
    let mut is_value = false;
    arguments.filter(move |word| {
        if std::mem::take(&mut is_value) {
            return false;
        }
        is_value = options.contains(&word.as_str());
        let joined = |option: &&str| {
            let rest = word.strip_prefix(*option);
            rest.is_some_and(|rest| rest.starts_with('='))
        };
        !is_value && !flags.contains(&word.as_str()) && !options.iter().any(joined)
    })
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
    use super::{command_line, quote, without};

    #[test]
    fn words_are_quoted_where_a_shell_needs_it() {
        assert_eq!(quote("--seed=1"), "--seed=1");
        assert_eq!(quote(""), "''");
        assert_eq!(quote("two words"), "'two words'");
        assert_eq!(quote("it's"), "'it'\\''s'");
        assert!(command_line("program").starts_with("program"));
    }

    #[test]
    fn where_the_work_was_done_is_left_out() {
        let words = "evaluate --shard 1/4 --folds 5 --merge --shard=2/4 --shards x --work --work w";
        let words = words.split(' ').map(str::to_owned);
        let left: Vec<_> = without(words, &["--merge"], &["--shard", "--work"]).collect();
        assert_eq!(left, ["evaluate", "--folds", "5", "--shards", "x", "w"]);
        let words = ["--flights", "my --resume/d", "--resume"].map(str::to_owned);
        let left: Vec<_> = without(words.into_iter(), &["--resume"], &[]).collect();
        assert_eq!(left, ["--flights", "my --resume/d"]);
    }
}
