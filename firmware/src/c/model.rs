//! A model.
#![allow(unsafe_code)]

use super::place::{BnkfModel, made, make};
use super::pointer::{Room, slice};
use super::settings::BnkfSettings;
use super::status::{BnkfStatus, said};
use crate::model::Model;
use crate::settings::Settings;

/// Checks the `length` bytes of `blob` and makes a model of them, which any number of tracks run on. The
/// weights are not copied: the bytes stay as they are for as long as the model is used. A step is a little
/// faster where they begin on a word boundary.
///
/// # Safety
/// `model` is room for a model that nobody else uses, and `blob` points to `length` bytes that nobody changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_model_init(
    model: *mut BnkfModel,
    blob: *const u8,
    length: usize,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        slice(blob, length)
            .and_then(|bytes| Model::new(bytes).map_err(BnkfStatus::from))
            .and_then(|made| make(model, made))
    })
}

/// The checksum of the model's blob, by which logs and tracks know it.
///
/// # Safety
/// `model` is room for a model, and `checksum` for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_model_checksum(
    model: *const BnkfModel,
    checksum: *mut u32,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        Room::new(checksum).and_then(|room| made(model).map(|model| room.put(model.checksum())))
    })
}

/// The settings that the model asks for: start from these.
///
/// # Safety
/// `model` is room for a model, and `settings` for settings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_model_settings(
    model: *const BnkfModel,
    settings: *mut BnkfSettings,
) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe {
        Room::new(settings).and_then(|room| {
            made(model).map(|model| room.put(BnkfSettings::from(Settings::of(model.blob()))))
        })
    })
}
