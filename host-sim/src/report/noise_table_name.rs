//! How a noise table is called.

use bnkf_model_export::radar::noise::NoiseTable;

/// Its name in sentences.
pub fn spelt(table: NoiseTable) -> &'static str {
    match table {
        NoiseTable::Radians => "radians (as the authors' code uses them)",
        NoiseTable::Printed => "degrees (as the paper prints them)",
    }
}
