//! The deepest that an image's stack can get, from its machine code: what every function takes, summed along
//! its calls.
//!
//! Paint tells how deep one run got; this holds for every input. Jumps into other functions count as calls,
//! which is never too little. A panic is left out, for nothing follows it, and so are interrupts, of which
//! the image enables none.

mod thumb;

use std::collections::{BTreeMap, HashMap};

use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

use thumb::{Effect, effects};

/// Where the image begins.
const ENTRY: &str = "Reset";
/// Calls within calls at most; an image has a dozen.
const DEPTH_MAX: u16 = 500;
/// In the name of every function that a panic begins with, as the compiler mangles them.
const PANIC: &str = "4core9panicking";

/// Why no bound can be told.
#[derive(Debug, thiserror::Error)]
pub enum StackError {
    /// It is no ELF file.
    #[error("the image is no ELF file: {0}")]
    Elf(#[from] object::Error),
    /// It has no beginning.
    #[error("the image has no function {ENTRY}")]
    NoEntry,
    /// A function takes what only a run tells.
    #[error("{function} moves the stack at {at:#010x} by what only a run tells")]
    Moves {
        /// Its name.
        function: String,
        /// Where.
        at: u32,
    },
    /// A function calls what a register says.
    #[error("{function} calls what a register says at {at:#010x}")]
    ByRegister {
        /// Its name.
        function: String,
        /// Where.
        at: u32,
    },
    /// A function calls itself, if through others.
    #[error("{0} calls itself, or is called too deeply")]
    Recursive(String),
}

/// A function of the image.
#[derive(Debug, Default)]
struct Function {
    name: String,
    /// Where it ends: up to the next one lie instructions that are never reached.
    end: u32,
    /// Bytes that it takes, all its branches together.
    takes: u32,
    /// Addresses that it jumps to, its own among them.
    goes: Vec<u32>,
    /// Addresses that it calls.
    calls: Vec<u32>,
    /// Why there is no bound where it is reached.
    unbounded: Option<(Effect, u32)>,
    /// The bound, once it is known; none while it is being looked for.
    bound: Option<u32>,
    visited: bool,
}

/// The most bytes that the stack of the image `elf` can hold.
///
/// # Errors
/// [`StackError`]
pub fn deepest(elf: &[u8]) -> Result<u32, StackError> {
    let elf = object::File::parse(elf)?;
    let mut functions = functions(&elf)?;
    let entry = functions
        .iter()
        .find_map(|(&at, function)| (function.name == ENTRY).then_some(at))
        .ok_or(StackError::NoEntry)?;
    bound(&mut functions, entry, DEPTH_MAX)
}

/// Every function by its address.
fn functions(elf: &object::File<'_>) -> Result<BTreeMap<u32, Function>, StackError> {
    let mut functions = BTreeMap::new();
    // Data between the instructions lie from a `$d` to the next `$t`.
    let mut is_code = BTreeMap::new();
    let mut names = HashMap::new();
    for symbol in elf.symbols() {
        let (at, name) = (symbol.address() as u32, symbol.name()?);
        if name.starts_with("$t") || name.starts_with("$d") {
            is_code.insert(at, name.starts_with("$t"));
        } else if symbol.kind() == SymbolKind::Text {
            // The lowest bit says Thumb. Of several names the first in the alphabet, of their sizes the largest.
            let (own, size): &mut (String, u32) = names.entry(at & !1).or_default();
            if own.is_empty() || name < own.as_str() {
                name.clone_into(own);
            }
            *size = symbol.size().try_into().unwrap_or(u32::MAX).max(*size);
        }
    }
    for section in elf.sections().filter(|s| s.kind() == SectionKind::Text) {
        let (data, from) = (section.data()?, section.address() as u32);
        let to = from.saturating_add(data.len() as u32);
        let mut edges: Vec<u32> = names.keys().chain(is_code.keys()).copied().collect();
        edges.retain(|at| (from..to).contains(at));
        edges.sort_unstable();
        edges.dedup();
        let ends = edges.iter().skip(1).copied().chain([to]);
        let (mut own, mut code) = (None, true);
        for (&at, end) in edges.iter().zip(ends) {
            code = is_code.get(&at).copied().unwrap_or(code);
            if let Some((name, size)) = names.get(&at) {
                own = Some(at);
                let function = Function {
                    name: name.clone(),
                    // Of handwritten ones no size is known.
                    end: if *size == 0 {
                        to
                    } else {
                        at.saturating_add(*size)
                    },
                    ..Function::default()
                };
                functions.insert(at, function);
            }
            let function = own.and_then(|own| functions.get_mut(&own));
            let (Some(function), true) = (function, code) else {
                continue;
            };
            let end = end.min(function.end).max(at);
            for (at, effect) in effects(&data[(at - from) as usize..(end - from) as usize], at) {
                match effect {
                    Effect::None => {}
                    Effect::Takes(bytes) => function.takes = function.takes.saturating_add(bytes),
                    Effect::Goes(to) => function.goes.push(to),
                    Effect::Calls(to) => function.calls.push(to),
                    Effect::GoesByRegister | Effect::Moves => {
                        function.unbounded.get_or_insert((effect, at));
                    }
                }
            }
        }
    }
    Ok(functions)
}

/// What the function at an address takes with all that it calls, at most so many calls deeper.
fn bound(functions: &mut BTreeMap<u32, Function>, at: u32, deeper: u16) -> Result<u32, StackError> {
    let Some(function) = functions.get_mut(&at) else {
        return Ok(0);
    };
    if function.name.contains(PANIC) {
        return Ok(0);
    }
    if let Some(bound) = function.bound {
        return Ok(bound);
    }
    let name = function.name.clone();
    if function.visited || deeper == 0 {
        return Err(StackError::Recursive(name));
    }
    match function.unbounded {
        Some((Effect::Moves, at)) => return Err(StackError::Moves { function: name, at }),
        Some((_, at)) => return Err(StackError::ByRegister { function: name, at }),
        None => {}
    }
    function.visited = true;
    let takes = function.takes;
    let goes = std::mem::take(&mut function.goes);
    let calls = std::mem::take(&mut function.calls);
    let jumps = goes.into_iter().map(|to| (to, false));
    let mut deepest = 0;
    for (to, calls) in jumps.chain(calls.into_iter().map(|to| (to, true))) {
        // A place within a function is that function's.
        let place = functions.range(..=to).next_back().map(|(&place, _)| place);
        let Some(place) = place else { continue };
        if place != at {
            deepest = deepest.max(bound(functions, place, deeper - 1)?);
        } else if calls {
            return Err(StackError::Recursive(name));
        }
    }
    let whole = takes.saturating_add(deepest);
    if let Some(function) = functions.get_mut(&at) {
        function.bound = Some(whole);
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(address, name, takes, goes)`
    fn program(functions: &[(u32, &str, u32, &[u32])]) -> BTreeMap<u32, Function> {
        let function = |&(at, name, takes, goes): &(u32, &str, u32, &[u32])| {
            let function = Function {
                name: name.to_owned(),
                takes,
                goes: goes.to_vec(),
                ..Function::default()
            };
            (at, function)
        };
        functions.iter().map(function).collect()
    }

    #[test]
    fn the_deepest_way_counts_and_a_panic_does_not() {
        let mut functions = program(&[
            (0, "Reset", 8, &[104, 200, 4]),
            (100, "shallow", 50, &[300]),
            (200, "deep", 20, &[300, 400, 500, 200]),
            (300, "leaf", 10, &[]),
            (400, "twice", 16, &[300, 300]),
            (500, "_RNvNtCs_4core9panicking5panic", 9_000, &[200]),
        ]);
        assert_eq!(bound(&mut functions, 0, 9).unwrap(), 8 + 50 + 10);
        assert_eq!(bound(&mut functions, 200, 9).unwrap(), 20 + 16 + 10);
    }

    #[test]
    fn who_calls_itself_has_no_bound_and_who_jumps_back_has() {
        let mut functions = program(&[(0, "loop", 8, &[4])]);
        assert_eq!(bound(&mut functions, 0, 9).unwrap(), 8);
        let mut functions = program(&[(0, "factorial", 8, &[])]);
        functions.get_mut(&0).unwrap().calls.push(0);
        let error = bound(&mut functions, 0, 9).unwrap_err().to_string();
        assert_eq!(error, "factorial calls itself, or is called too deeply");
    }

    #[test]
    fn what_has_no_bound_is_named_where_it_is_reached() {
        let mut functions = program(&[(0, "even", 8, &[100]), (100, "odd", 8, &[0])]);
        let error = bound(&mut functions, 0, 9).unwrap_err().to_string();
        assert_eq!(error, "even calls itself, or is called too deeply");
        let mut functions = program(&[(0, "a", 8, &[100]), (100, "b", 8, &[])]);
        assert!(bound(&mut functions, 0, 1).is_err(), "too deep");
        for (effect, says) in [
            (
                Effect::Moves,
                "moves the stack at 0x00000066 by what only a run tells",
            ),
            (
                Effect::GoesByRegister,
                "calls what a register says at 0x00000066",
            ),
        ] {
            let odd = |goes: &[u32]| {
                let mut functions = program(&[(0, "Reset", 8, goes), (100, "odd", 8, &[])]);
                functions.get_mut(&100).unwrap().unbounded = Some((effect, 0x66));
                bound(&mut functions, 0, 9)
            };
            let error = odd(&[100]).unwrap_err().to_string();
            assert_eq!(error, format!("odd {says}"));
            assert_eq!(odd(&[]).unwrap(), 8);
        }
    }

    #[test]
    fn what_is_no_image_is_said() {
        assert!(matches!(deepest(b"no ELF"), Err(StackError::Elf(_))));
    }
}
