//! A method's name behind a piece of its line with its marker, as figures draw it.

use crate::method::Method;
use crate::plot::palette::look;
use crate::plot::svg::escaped;

/// Name of the symbol of `method` on the page.
pub fn id(method: Method) -> String {
    let letters = method.label().chars();
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '-'
        }
    };
    format!("mark-{}", letters.map(plain).collect::<String>())
}

/// The symbols of `methods`, once for the page.
pub fn symbols(methods: &[Method]) -> String {
    let symbol = |method: &Method| {
        let look = look(*method);
        let (fill, stroke) = look.marker.ink(look.colour);
        format!(
            "<symbol id=\"{}\" viewBox=\"0 0 28 14\"><path d=\"M1,7H27\" fill=\"none\"{}/>\
             <path d=\"{}\" transform=\"translate(14 7)\" fill=\"{fill}\"{stroke}/></symbol>\n",
            id(*method),
            look.stroke(2.0),
            look.marker.outline(4.2),
        )
    };
    let all: String = methods.iter().map(symbol).collect();
    format!("<svg width=\"0\" height=\"0\" class=\"symbols\" aria-hidden=\"true\">\n{all}</svg>\n")
}

/// Mark and label.
pub fn swatched(method: Method) -> String {
    format!(
        "<svg class=\"swatch\" aria-hidden=\"true\"><use href=\"#{}\"/></svg>{}",
        id(method),
        escaped(method.label())
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::ValueEnum;

    use super::{id, swatched, symbols};
    use crate::method::Method;
    use crate::own_name::OwnName;

    #[test]
    fn every_swatch_has_its_symbol() {
        let methods = Method::value_variants();
        let all = symbols(methods);
        for method in methods {
            assert!(all.contains(&format!("id=\"{}\"", id(*method))), "{method}");
            assert!(swatched(*method).contains(&format!("#{}\"", id(*method))));
        }
        let ids: BTreeSet<_> = methods.iter().map(|method| id(*method)).collect();
        assert_eq!(ids.len(), methods.len());
        let own = Method::Own(OwnName::new("mine").unwrap());
        assert_eq!(id(own), "mark-mine");
    }
}
