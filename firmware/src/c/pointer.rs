//! Pointers from C, checked before they are used.
#![allow(unsafe_code)]

use super::status::BnkfStatus;

/// Checks what can be seen of a pointer.
pub fn check<T>(pointer: *const T) -> Result<(), BnkfStatus> {
    if pointer.is_null() {
        Err(BnkfStatus::NullPointer)
    } else if !pointer.is_aligned() {
        Err(BnkfStatus::MisalignedPointer)
    } else {
        Ok(())
    }
}

/// The value behind a pointer.
///
/// # Safety
/// If it passes [`check`] it points to a value.
pub unsafe fn read<T: Copy>(pointer: *const T) -> Result<T, BnkfStatus> {
    check(pointer)?;
    // SAFETY: by contract.
    Ok(unsafe { pointer.read() })
}

/// `length` values behind a pointer, which may be null for none.
///
/// # Safety
/// If it passes [`check`] it points to `length` values, which stay as they are for as long as the slice is used.
pub unsafe fn slice<'a, T: Copy>(pointer: *const T, length: usize) -> Result<&'a [T], BnkfStatus> {
    if length == 0 {
        return Ok(&[]);
    }
    check(pointer)?;
    // No object is larger.
    if length > isize::MAX as usize / size_of::<T>() {
        return Err(BnkfStatus::Length);
    }
    // SAFETY: by contract, and not too long.
    Ok(unsafe { core::slice::from_raw_parts(pointer, length) })
}

/// Room for an answer, checked before the question is asked.
pub struct Room<T>(*mut T);

impl<T> Room<T> {
    /// # Safety
    /// If `pointer` passes [`check`] a value can be written there, and nothing else lies there.
    pub unsafe fn new(pointer: *mut T) -> Result<Self, BnkfStatus> {
        check(pointer)?;
        Ok(Self(pointer))
    }

    /// Writes the answer.
    pub fn put(self, value: T) {
        // SAFETY: by contract of `new`.
        unsafe { self.0.write(value) }
    }
}
