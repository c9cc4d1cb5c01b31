//! Places of C's own that a model, a workspace or a track is made in.
#![allow(unsafe_code)]

use super::pointer::check;
use super::status::BnkfStatus;
use crate::model::{MODEL_BYTES_MAX, Model};
use crate::track::{TRACK_BYTES_MAX, Track};
use crate::workspace::{WORKSPACE_BYTES_MAX, Workspace};

/// Room for a model: a checked blob. It may be copied; the blob's bytes stay where they are, unchanged, for
/// as long as any copy is used.
#[repr(C)]
#[derive(Debug)]
pub struct BnkfModel {
    /// Nobody else's; zero before it was made.
    pub words: [u64; BNKF_MODEL_WORDS],
}

/// Room for the working memory of a step. Any number of tracks share it, one call at a time.
#[repr(C)]
#[derive(Debug)]
pub struct BnkfWorkspace {
    /// Nobody else's; zero before it was made.
    pub words: [u64; BNKF_WORKSPACE_WORDS],
}

/// Room for a track: all that is known of one target. A copy is a snapshot.
#[repr(C)]
#[derive(Debug)]
pub struct BnkfTrack {
    /// Nobody else's; zero before it was made.
    pub words: [u64; BNKF_TRACK_WORDS],
}

/// Size of a [`BnkfModel`], in words of eight bytes.
pub const BNKF_MODEL_WORDS: usize = words(MODEL_BYTES_MAX);
/// Size of a [`BnkfWorkspace`], in words of eight bytes.
pub const BNKF_WORKSPACE_WORDS: usize = words(WORKSPACE_BYTES_MAX);
/// Size of a [`BnkfTrack`], in words of eight bytes.
pub const BNKF_TRACK_WORDS: usize = words(TRACK_BYTES_MAX);

/// A mark and so many bytes.
const fn words(bytes: usize) -> usize {
    1 + bytes.div_ceil(8)
}

/// What a place holds: a mark that something was made there, and what was made.
#[repr(C)]
struct Made<T> {
    mark: u64,
    value: T,
}

/// A place, and what is made in it.
pub trait Place: Sized {
    /// What is made in it.
    type Value;
    /// What it begins with then, its own, so that no other place passes for it.
    const MARK: u64;
    /// The value fits.
    const FITS: () = assert!(
        size_of::<Made<Self::Value>>() <= size_of::<Self>()
            && align_of::<Made<Self::Value>>() <= align_of::<Self>()
    );
}

impl Place for BnkfModel {
    type Value = Model<'static>;
    const MARK: u64 = u64::from_le_bytes(*b"BNKFmodl");
}
impl Place for BnkfWorkspace {
    type Value = Workspace;
    const MARK: u64 = u64::from_le_bytes(*b"BNKFwork");
}
impl Place for BnkfTrack {
    type Value = Track;
    const MARK: u64 = u64::from_le_bytes(*b"BNKFtrck");
}
const _: () = (BnkfModel::FITS, BnkfWorkspace::FITS, BnkfTrack::FITS).0;

/// Makes a value in a place, whatever is there.
///
/// # Safety
/// If `place` passes [`check`] it is a place, and nobody else uses it meanwhile.
// Written where it will be: inlined, it might be made on the stack and moved there.
#[inline(always)]
pub unsafe fn make<P: Place>(place: *mut P, value: P::Value) -> Result<(), BnkfStatus> {
    check(place)?;
    let mark = P::MARK;
    // SAFETY: by contract; the value fits.
    unsafe { place.cast::<Made<P::Value>>().write(Made { mark, value }) };
    Ok(())
}

/// What was made in a place.
///
/// # Safety
/// If `place` passes [`check`] it is a place, and nobody changes it meanwhile.
pub unsafe fn made<'a, P: Place>(place: *const P) -> Result<&'a P::Value, BnkfStatus> {
    // SAFETY: by contract.
    unsafe { marked(place.cast_mut()).map(|made| &(*made).value) }
}

/// What was made in a place, to be changed.
///
/// # Safety
/// If `place` passes [`check`] it is a place, and nobody else uses it meanwhile.
pub unsafe fn made_mut<'a, P: Place>(place: *mut P) -> Result<&'a mut P::Value, BnkfStatus> {
    // SAFETY: by contract.
    unsafe { marked(place).map(|made| &mut (*made).value) }
}

/// # Safety
/// If `place` passes [`check`] it can be read.
unsafe fn marked<P: Place>(place: *mut P) -> Result<*mut Made<P::Value>, BnkfStatus> {
    check(place)?;
    let made = place.cast::<Made<P::Value>>();
    // SAFETY: by contract; any bits are a number.
    if unsafe { (*made).mark } == P::MARK {
        Ok(made)
    } else {
        Err(BnkfStatus::NotInitialised)
    }
}
