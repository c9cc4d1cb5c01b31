//! A picture as SVG text. Coordinates are CSS pixels, x to the right, y down.

use std::fmt::Write as _;

use crate::plot::ink::{FAINT_INK, INK, PAPER, night_style};

/// A rectangle, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Left edge.
    pub x: f64,
    /// Upper edge.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Stroke<'a> {
    /// CSS colour.
    pub colour: &'a str,
    /// Width, pixels.
    pub width: f64,
    /// Lengths of dash and blank, pixels; empty for a solid line.
    pub dash: &'a str,
}

impl<'a> Stroke<'a> {
    /// A solid line.
    pub const fn solid(colour: &'a str, width: f64) -> Self {
        Self {
            colour,
            width,
            dash: "",
        }
    }
}

/// As attributes of an element.
impl std::fmt::Display for Stroke<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let width = Number(self.width);
        write!(f, " stroke=\"{}\" stroke-width=\"{width}\"", self.colour)?;
        if self.dash.is_empty() {
            return Ok(());
        }
        write!(f, " stroke-dasharray=\"{}\"", self.dash)
    }
}

/// Which point of a text lies at its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// Its left end.
    Start,
    /// Its middle.
    Middle,
    /// Its right end.
    End,
}

/// How a text is set. The vertical position is its middle.
#[derive(Clone, Copy, Debug)]
pub struct Lettering {
    /// Font size, pixels.
    pub size: f64,
    /// CSS colour.
    pub colour: &'static str,
    /// Horizontal reference.
    pub anchor: Anchor,
    /// Heavier weight.
    pub bold: bool,
    /// Turned to read from bottom to top.
    pub upright: bool,
}

/// Text that starts at its position, in the ink colour.
pub const fn lettering(size: f64) -> Lettering {
    Lettering {
        size,
        colour: INK,
        anchor: Anchor::Start,
        bold: false,
        upright: false,
    }
}

/// A picture under construction.
#[derive(Debug)]
pub struct Svg {
    width: f64,
    height: f64,
    body: String,
}

impl Svg {
    /// An empty white picture, dark where the reader's system is; a screen reader says `title`, then
    /// `description`.
    pub fn new(width: f64, height: f64, title: &str, description: &str) -> Self {
        let mut svg = Self {
            width,
            height,
            body: String::new(),
        };
        svg.push(format_args!("<title>{}</title>", escaped(title)));
        svg.push(format_args!("<desc>{}</desc>", escaped(description)));
        svg.push(format_args!("{}", night_style()));
        let page = Rect {
            x: 0.0,
            y: 0.0,
            width,
            height,
        };
        svg.rect(page, PAPER, 1.0);
        svg
    }

    /// The finished document. Nothing in it has a name, so any number of them may share a page.
    pub fn finish(self) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" \
             role=\"img\" stroke-linejoin=\"round\" stroke-linecap=\"round\" font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\">\n{body}</svg>\n",
            w = Number(self.width),
            h = Number(self.height),
            body = self.body,
        )
    }

    fn push(&mut self, element: std::fmt::Arguments<'_>) {
        // Writing to a String cannot fail.
        self.body.write_fmt(element).expect("a String grows");
        self.body.push('\n');
    }

    /// A filled rectangle without border.
    pub fn rect(&mut self, rect: Rect, fill: &str, opacity: f64) {
        let Rect {
            x,
            y,
            width,
            height,
        } = rect;
        self.push(format_args!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{fill}\" fill-opacity=\"{}\"/>",
            Number(x), Number(y), Number(width), Number(height), Number(opacity)
        ));
    }

    /// A polyline. It breaks where a point is not finite.
    pub fn polyline(&mut self, points: &[(f64, f64)], stroke: Stroke<'_>) {
        for part in points.split(|(x, y)| !(x.is_finite() && y.is_finite())) {
            if part.len() < 2 {
                continue;
            }
            self.push(format_args!(
                "<polyline points=\"{}\" fill=\"none\"{stroke}/>",
                coordinates(part),
            ));
        }
    }

    /// A filled polygon without border; its points must be finite.
    pub fn polygon(&mut self, points: &[(f64, f64)], fill: &str, opacity: f64) {
        self.push(format_args!(
            "<polygon points=\"{}\" fill=\"{fill}\" fill-opacity=\"{}\"/>",
            coordinates(points),
            Number(opacity)
        ));
    }

    /// An outline around the origin, moved to `at`, filled and drawn.
    pub fn path(&mut self, outline: &str, (x, y): (f64, f64), fill: &str, stroke: Stroke<'_>) {
        self.push(format_args!(
            "<path d=\"{outline}\" transform=\"translate({} {})\" fill=\"{fill}\"{stroke}/>",
            Number(x),
            Number(y),
        ));
    }

    /// A filled circle without border.
    pub fn circle(&mut self, (x, y): (f64, f64), radius: f64, fill: &str) {
        self.push(format_args!(
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{fill}\"/>",
            Number(x),
            Number(y),
            Number(radius)
        ));
    }

    /// A line of text.
    pub fn text(&mut self, (x, y): (f64, f64), text: &str, lettering: Lettering) {
        let Lettering {
            size,
            colour,
            anchor,
            bold,
            upright,
        } = lettering;
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let weight = if bold { " font-weight=\"600\"" } else { "" };
        let turn = if upright {
            format!(" transform=\"rotate(-90 {} {})\"", Number(x), Number(y))
        } else {
            String::new()
        };
        self.push(format_args!(
            "<text x=\"{}\" y=\"{}\" dy=\"0.35em\" font-size=\"{}\" fill=\"{colour}\" \
             text-anchor=\"{anchor}\"{weight}{turn}>{}</text>",
            Number(x),
            Number(y),
            Number(size),
            escaped(text)
        ));
    }

    /// The figure's heading.
    pub fn heading(&mut self, at: (f64, f64), content: &str) {
        let heavy = Lettering {
            bold: true,
            ..lettering(18.0)
        };
        self.text(at, content, heavy);
    }

    /// A remark below the heading.
    pub fn note(&mut self, at: (f64, f64), content: &str) {
        let faint = Lettering {
            colour: FAINT_INK,
            ..lettering(12.5)
        };
        self.text(at, content, faint);
    }

    /// A small remark inside a panel, on paper so that lines below do not cross it.
    pub fn remark(&mut self, (x, y): (f64, f64), content: &str, anchor: Anchor) {
        let width = 5.8 * content.chars().count() as f64 + 4.0;
        let left = match anchor {
            Anchor::Start => x - 2.0,
            Anchor::Middle => x - 0.5 * width,
            Anchor::End => x - width + 2.0,
        };
        let paper = Rect {
            x: left,
            y: y - 7.0,
            width,
            height: 14.0,
        };
        self.rect(paper, PAPER, 0.85);
        let faint = Lettering {
            anchor,
            colour: FAINT_INK,
            ..lettering(10.5)
        };
        self.text((x, y), content, faint);
    }

    /// Draws with everything outside `rect` cut off: a picture in the picture, which needs no name as a clip path does.
    pub fn clipped(&mut self, rect: Rect, draw: impl FnOnce(&mut Self)) {
        let Rect {
            x,
            y,
            width,
            height,
        } = rect;
        self.push(format_args!(
            "<svg x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" viewBox=\"{x} {y} {w} {h}\">",
            x = Number(x),
            y = Number(y),
            w = Number(width),
            h = Number(height),
        ));
        draw(self);
        self.push(format_args!("</svg>"));
    }

    /// Draws with a tooltip that names what is under the pointer.
    pub fn titled(&mut self, title: &str, draw: impl FnOnce(&mut Self)) {
        self.push(format_args!("<g><title>{}</title>", escaped(title)));
        draw(self);
        self.push(format_args!("</g>"));
    }
}

/// A number with two decimals at most: a hundredth of a pixel is below what any screen shows.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.2}", self.0);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        f.write_str(if text == "-0" { "0" } else { text })
    }
}

fn coordinates(points: &[(f64, f64)]) -> String {
    let pairs: Vec<_> = points
        .iter()
        .map(|(x, y)| format!("{},{}", Number(*x), Number(*y)))
        .collect();
    pairs.join(" ")
}

/// Text with XML's special characters replaced.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        // The page's template fills `{{places}}`: a name is none.
        .replace('{', "&#123;")
}

#[cfg(test)]
mod tests {
    use super::{Rect, Stroke, Svg, lettering};
    use crate::plot::ink::INK;

    #[test]
    fn text_is_escaped() {
        let mut svg = Svg::new(100.0, 50.0, "a < b", "c & d");
        svg.text((1.0, 2.0), "P & \"Q\" > {R}", lettering(12.0));
        let text = svg.finish();
        assert!(text.contains("<title>a &lt; b</title>\n<desc>c &amp; d</desc>"));
        assert!(text.contains(">P &amp; &quot;Q&quot; &gt; &#123;R}</text>"));
    }

    #[test]
    fn a_line_breaks_where_it_has_no_value() {
        let mut svg = Svg::new(10.0, 10.0, "", "");
        let points = [
            (0.0, 0.0),
            (1.0, 0.5),
            (2.0, f64::NAN),
            (3.0, 1.0),
            (4.0, 1.126),
        ];
        svg.polyline(&points, Stroke::solid(INK, 1.0));
        let text = svg.finish();
        assert!(text.contains("points=\"0,0 1,0.5\""));
        assert!(text.contains("points=\"3,1 4,1.13\""));
        assert!(!text.contains("NaN"));
    }

    /// What is cut off stands where it stood, and several pictures may share a page.
    #[test]
    fn what_is_clipped_keeps_its_place_and_has_no_name() {
        let mut svg = Svg::new(10.0, 10.0, "", "");
        let rect = Rect {
            x: 1.0,
            y: 2.0,
            width: 5.0,
            height: 4.0,
        };
        svg.clipped(rect, |svg| svg.circle((1.0, 1.0), 1.0, INK));
        let text = svg.finish();
        let inner = "<svg x=\"1\" y=\"2\" width=\"5\" height=\"4\" viewBox=\"1 2 5 4\">\n<circle";
        assert!(text.contains(inner), "{text}");
        assert!(!text.contains(" id=") && text.ends_with("</svg>\n</svg>\n"));
    }
}
