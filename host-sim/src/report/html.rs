//! HTML that grows.

/// Adds `text`.
pub fn push(html: &mut String, text: std::fmt::Arguments<'_>) {
    // Writing to a String cannot fail.
    std::fmt::Write::write_fmt(html, text).expect("a String grows");
}
