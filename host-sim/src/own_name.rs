//! Names of methods that are not built in.

use std::collections::HashSet;
use std::sync::{LazyLock, Mutex, PoisonError};

/// Most characters of a name: it heads rows of tables and stands beside figures.
pub const CHARACTERS_MAX: usize = 24;

/// Every name that was ever given; they are few, and methods are copied everywhere.
static KNOWN: LazyLock<Mutex<HashSet<&'static str>>> = LazyLock::new(Mutex::default);

/// Name of a method that is not built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OwnName(&'static str);

/// Why a text is no name of a method.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is no name for a method: one to {CHARACTERS_MAX} letters, digits, blanks or any of - _ . + ( )"
)]
pub struct OwnNameError(pub String);

impl OwnName {
    /// The name `text`.
    ///
    /// # Errors
    /// It is empty or too long, begins or ends with a blank, or has other characters.
    pub fn new(text: &str) -> Result<Self, OwnNameError> {
        let usable = |c: char| c.is_alphanumeric() || " -_.+()".contains(c);
        let is_name = (1..=CHARACTERS_MAX).contains(&text.chars().count())
            && text.trim() == text
            && text.chars().all(usable);
        if !is_name {
            return Err(OwnNameError(text.chars().take(40).collect()));
        }
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(name) = known.get(text) {
            return Ok(Self(name));
        }
        let name: &'static str = Box::leak(text.to_owned().into_boxed_str());
        known.insert(name);
        Ok(Self(name))
    }

    /// The text.
    pub const fn get(self) -> &'static str {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_text_is_the_same_name() {
        let name = OwnName::new("my IMM-3 (v2)").unwrap();
        assert_eq!(name, OwnName::new("my IMM-3 (v2)").unwrap());
        assert_eq!(name.get(), "my IMM-3 (v2)");
        assert!(std::ptr::eq(
            name.get(),
            OwnName::new("my IMM-3 (v2)").unwrap().get()
        ));
    }

    #[test]
    fn what_spoils_a_table_or_a_page_is_no_name() {
        for text in ["", " a", "a ", "a\nb", "<b>", "a,b", "\"", &"x".repeat(25)] {
            assert!(OwnName::new(text).is_err(), "{text:?}");
        }
        assert!(OwnName::new(&"\u{e4}".repeat(24)).is_ok());
    }
}
