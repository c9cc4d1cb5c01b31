//! Nothing in the firmware can panic: a program whose panic handler has no definition links.
//!
//! Needs a compiler for the microcontroller; without one it says so and passes, because there is nothing that
//! it could say then.

use bnkf_host_sim::image::build::build_program;
use bnkf_host_sim::image::toolchain::{Toolchain, ToolchainChoice};

#[test]
fn no_path_to_a_panic_is_left() {
    let toolchain = match Toolchain::find(ToolchainChoice::Auto) {
        Ok(toolchain) => toolchain,
        Err(error) => {
            eprintln!("not checked here: {error}");
            return;
        }
    };
    if let Err(error) = build_program(&toolchain, "panic-free") {
        panic!("{error}; an undefined `something_here_can_panic` is a path to a panic");
    }
}
