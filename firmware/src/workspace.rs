//! Working memory of a step.

use crate::network::Scratch;
use crate::recursive::target::Target;

/// Working memory that any number of tracks share, whichever is asked: its contents mean nothing
/// between calls. Made before anything runs, it can be a `static`.
pub struct Workspace {
    /// The network's.
    pub(crate) scratch: Scratch,
    /// The target on its way through a step.
    pub(crate) target: Target,
}

/// Memory of a [`Workspace`], part of the contract.
pub const WORKSPACE_BYTES_MAX: usize = 7_800;
const _: () = assert!(size_of::<Workspace>() <= WORKSPACE_BYTES_MAX);

impl Workspace {
    /// A new one.
    pub const fn new() -> Self {
        Self {
            scratch: Scratch::new(),
            target: Target::NONE,
        }
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

impl core::fmt::Debug for Workspace {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Workspace").finish_non_exhaustive()
    }
}
