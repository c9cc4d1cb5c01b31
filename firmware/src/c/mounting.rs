//! Directions in a sensor's own axes.
#![allow(unsafe_code)]

use super::measurement::BnkfSensed;
use super::pointer::Room;
use super::status::{BnkfStatus, said};
use crate::measurement::Channel;
use crate::mounting::Mounting;

/// A direction in the track's axes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BnkfDirection {
    /// Elevation, rad.
    pub elevation: BnkfSensed,
    /// Azimuth, rad.
    pub azimuth: BnkfSensed,
    /// Whether there is an azimuth: near the vertical there is none.
    pub has_azimuth: bool,
}

/// A direction in the axes of a sensor that is turned by yaw, pitch and roll (rad), as one in the track's axes; what
/// no measurement may have, and a turn that is not finite, is named, and nothing is written then.
///
/// # Safety
/// `direction` is room for a direction.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_mounting_direction(
    yaw_rad: f32,
    pitch_rad: f32,
    roll_rad: f32,
    elevation: BnkfSensed,
    azimuth: BnkfSensed,
    direction: *mut BnkfDirection,
) -> BnkfStatus {
    if ![yaw_rad, pitch_rad, roll_rad]
        .iter()
        .all(|angle| angle.is_finite())
    {
        return BnkfStatus::SensorNotFinite;
    }
    for (channel, angle) in [(Channel::Elevation, elevation), (Channel::Azimuth, azimuth)] {
        if let Err(error) = channel.check(angle.into()) {
            return BnkfStatus::from(error);
        }
    }
    // SAFETY: by contract.
    said(unsafe { Room::new(direction) }.map(|room| {
        let seen =
            Mounting::new(yaw_rad, pitch_rad, roll_rad).direction(elevation.into(), azimuth.into());
        room.put(BnkfDirection {
            elevation: seen.elevation.into(),
            azimuth: seen.azimuth.map(BnkfSensed::from).unwrap_or_default(),
            has_azimuth: seen.azimuth.is_some(),
        });
    }))
}
