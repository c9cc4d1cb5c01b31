//! A model as tracks run it.

use crate::blob::{Blob, BlobError, Kind};
use crate::{memoryless, recursive};

/// A checked blob and what of it every step asks for, decoded. Any number of tracks run on one.
///
/// A memoryless blob holds one network for all axes (BNKF) or one per axis (BNKFe) that answer
/// with a position; a recursive blob holds one that schedules the motion model of a filter.
#[derive(Clone, Copy)]
pub struct Model<'a> {
    pub(crate) inner: Inner<'a>,
}

#[derive(Clone, Copy)]
pub(crate) enum Inner<'a> {
    Memoryless(memoryless::Model<'a>),
    Recursive(recursive::Model<'a>),
}

/// Memory of a [`Model`], part of the contract; the blob is beside it.
pub const MODEL_BYTES_MAX: usize = 384;
const _: () = assert!(size_of::<Model<'static>>() <= MODEL_BYTES_MAX);

impl<'a> Model<'a> {
    /// Checks `bytes` and decodes what surrounds the networks; the weights stay where they are.
    ///
    /// # Errors
    /// As of [`Blob::parse`].
    pub fn new(bytes: &'a [u8]) -> Result<Self, BlobError> {
        Blob::parse(bytes).map(Self::from)
    }

    /// The blob.
    pub fn blob(&self) -> &Blob<'a> {
        match &self.inner {
            Inner::Memoryless(model) => &model.blob,
            Inner::Recursive(model) => &model.blob,
        }
    }

    /// What its networks estimate.
    pub fn kind(&self) -> Kind {
        self.blob().kind()
    }

    /// The checksum of its bytes, by which a [`Track`](crate::Track) knows it.
    pub fn checksum(&self) -> u32 {
        self.blob().checksum()
    }
}

impl<'a> From<Blob<'a>> for Model<'a> {
    fn from(blob: Blob<'a>) -> Self {
        let inner = match blob.kind() {
            Kind::Memoryless => Inner::Memoryless(memoryless::Model::new(blob)),
            Kind::Recursive => Inner::Recursive(recursive::Model::new(blob)),
        };
        Self { inner }
    }
}

impl core::fmt::Debug for Model<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Model")
            .field("kind", &self.kind())
            .field("checksum", &format_args!("{:08x}", self.checksum()))
            .finish_non_exhaustive()
    }
}
