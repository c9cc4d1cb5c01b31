//! A checked model and the bytes that it reads.

use std::path::PathBuf;
use std::sync::Arc;

use bnkf::blob::Kind;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use self_cell::self_cell;

use crate::error;

type Decoded<'a> = bnkf::Model<'a>;

self_cell!(
    /// A model's bytes and what was decoded of them.
    pub struct Owned {
        owner: Box<[u8]>,
        #[covariant]
        dependent: Decoded,
    }
);

/// A checked model; any number of trackers share it.
///
/// source: the bytes of a `.bnkf` file, or its path. Raises ModelError for bytes that are no model, OSError for
/// a file that cannot be read.
#[pyclass(frozen, module = "bnkf")]
#[derive(Clone)]
pub struct Model {
    pub owned: Arc<Owned>,
}

#[pymethods]
impl Model {
    #[new]
    fn new(source: &Bound<'_, PyAny>) -> PyResult<Self> {
        let bytes = if let Ok(bytes) = source.cast::<PyBytes>() {
            bytes.as_bytes().to_vec()
        } else {
            let path: PathBuf = source.extract()?;
            std::fs::read(&path).map_err(|cause| {
                let said = format!("{}: {cause}", path.display());
                std::io::Error::new(cause.kind(), said)
            })?
        };
        let owned = Owned::try_new(bytes.into(), |bytes| bnkf::Model::new(bytes));
        owned
            .map(|owned| Self {
                owned: Arc::new(owned),
            })
            .map_err(error::model)
    }

    /// "recursive" or "memoryless".
    #[getter]
    fn kind(&self) -> &'static str {
        match self.decoded().kind() {
            Kind::Memoryless => "memoryless",
            Kind::Recursive => "recursive",
        }
    }

    /// CRC-32 of its bytes, by which a track knows it.
    #[getter]
    fn checksum(&self) -> u32 {
        self.decoded().checksum()
    }

    /// Monte Carlo passes that it asks for; 1 is mean weights.
    #[getter]
    fn passes(&self) -> u16 {
        self.decoded().blob().passes()
    }

    pub fn __repr__(&self) -> String {
        format!(
            "Model(kind={:?}, checksum={:08x})",
            self.kind(),
            self.checksum()
        )
    }
}

impl Model {
    /// What was decoded of its bytes.
    pub fn decoded(&self) -> &bnkf::Model<'_> {
        self.owned.borrow_dependent()
    }
}
