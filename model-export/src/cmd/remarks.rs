//! What a command says on the standard error stream before it works.

/// Remarks as they are, and what was left out, and why, as warnings.
pub fn say(remarks: &[String], left_out: &[String]) {
    for remark in remarks {
        eprintln!("{remark}");
    }
    for reason in left_out {
        eprintln!("warning: left out: {reason}");
    }
}
