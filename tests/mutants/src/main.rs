//! All changes of `cargo mutants --list --json` in one build; `tests/mutants_at_once.sh` is the
//! whole of it.

mod list;
mod rewrite;
mod run;

use std::collections::BTreeSet;
use std::error::Error;
use std::path::Path;

const USAGE: &str = "rewrite LIST TREE UNVIABLE | run LIST TREE UNVIABLE BINARY RESULTS [SHARD/OF]";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (what, [list, tree, unviable], rest) = match arguments[..] {
        [what, list, tree, unviable, ref rest @ ..] => (what, [list, tree, unviable], rest),
        _ => return Err(USAGE.into()),
    };
    let changes = list::read(Path::new(list))?;
    let unviable: BTreeSet<usize> = std::fs::read_to_string(unviable)?
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    match (what, rest) {
        ("rewrite", []) => rewrite::all(&changes, Path::new(tree), &unviable),
        ("run", [binary, results, shard @ ..]) => {
            let shard = match shard {
                [] => (0, 1),
                [text, ..] => {
                    let (number, of) = text.split_once('/').ok_or(USAGE)?;
                    (number.parse()?, of.parse()?)
                }
            };
            run::shard(&changes, Path::new(tree), &unviable, binary, results, shard)
        }
        _ => Err(USAGE.into()),
    }
}
