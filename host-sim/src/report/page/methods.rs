//! The methods, as a table.

use crate::method::Method;
use crate::plot::svg::escaped;
use crate::report::html::push;
use crate::report::swatch::swatched;

/// What each method is.
pub fn methods(methods: &[Method]) -> String {
    let mut html = "<div class=\"scroll\"><table>\n<tbody>\n".to_owned();
    for method in methods {
        push(
            &mut html,
            format_args!(
                "<tr><th class=\"method\">{}</th><td class=\"text\">{}</td></tr>\n",
                swatched(*method),
                escaped(method.description())
            ),
        );
    }
    html.push_str("</tbody></table></div>\n");
    html
}
