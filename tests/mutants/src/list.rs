//! The changes as cargo-mutants lists them.

use std::error::Error;
use std::path::Path;

/// Line and column, from one.
pub type Place = (usize, usize);

/// One change; its number is its place in the list, from one.
pub struct Change {
    pub number: usize,
    pub name: String,
    pub file: String,
    pub genre: String,
    pub replacement: String,
    pub place: Place,
}

/// Reads the list.
pub fn read(path: &Path) -> Result<Vec<Change>, Box<dyn Error>> {
    let list: Vec<serde_json::Value> = serde_json::from_str(&std::fs::read_to_string(path)?)?;
    let read = |(index, item): (usize, &serde_json::Value)| {
        let text = |key: &str| item[key].as_str().map(str::to_owned);
        let start = &item["span"]["start"];
        let number = |key: &str| start[key].as_u64().map(|n| n as usize);
        Some(Change {
            number: index + 1,
            name: text("name")?,
            file: text("file")?,
            genre: text("genre")?,
            replacement: text("replacement")?,
            place: (number("line")?, number("column")?),
        })
    };
    let changes: Option<Vec<_>> = list.iter().enumerate().map(read).collect();
    changes.ok_or_else(|| "the list is not one of cargo-mutants 27".into())
}
