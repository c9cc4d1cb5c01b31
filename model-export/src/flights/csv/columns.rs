//! Which columns of a flight file hold time and position.
//!
//! `timestamp,tx,ty,tz` and, in any case of letters: `time` or `t`, with a unit behind it
//! (`time_us`, `timestamp [ms]`); `x,y,z`, `px,py,pz`, `pos_x,...`, `position_x,...`;
//! `east,north,up` or `e,n,u`; `north,east,down` or `n,e,d`; metres may be said (`x_m`, `x [m]`).

use super::frame::Frame;
use super::options::ReadOptions;
use super::records::{Record, Separator};
use super::time_unit::TimeUnit;
use crate::flights::flight::SampleField;

/// Names of the time, the first that is found.
const TIMES: [&str; 4] = ["timestamp", "time", "osd.flytime", "t"];

/// Names of positions along x, y and z, and the frame they say, the first that is found.
const POSITIONS: [([&str; 3], Option<Frame>); 10] = [
    (["tx", "ty", "tz"], Some(Frame::Enu)),
    (["east", "north", "up"], Some(Frame::Enu)),
    (["north", "east", "down"], Some(Frame::Ned)),
    (["e", "n", "u"], Some(Frame::Enu)),
    (["n", "e", "d"], Some(Frame::Ned)),
    (["p_rs_r_x", "p_rs_r_y", "p_rs_r_z"], Some(Frame::Enu)),
    (["x", "y", "z"], None),
    (["px", "py", "pz"], None),
    (["pos_x", "pos_y", "pos_z"], None),
    (["position_x", "position_y", "position_z"], None),
];

/// Names of latitudes, of longitudes, and of heights above the ground and above anything else, in their order.
const LATITUDES: [&str; 4] = ["latitude", "lat", "osd.latitude", "gps.latitude"];
const LONGITUDES: [&str; 5] = ["longitude", "lon", "lng", "osd.longitude", "gps.longitude"];
const HEIGHTS: [&str; 4] = [
    "height_above_takeoff",
    "relative_altitude",
    "osd.height",
    "rel_alt",
];
const ALTITUDES: [&str; 7] = [
    "height",
    "altitude",
    "alt",
    "ellipsoidal_height",
    "altitude_above_sealevel",
    "osd.altitude",
    "gps.altitude",
];

/// Units that may stand behind a position's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    Metre,
    Foot,
    Degree,
}

/// How they are written there.
const ENDINGS: [(&str, Unit); 14] = [
    ("(feet)", Unit::Foot),
    ("[feet]", Unit::Foot),
    ("(ft)", Unit::Foot),
    ("[ft]", Unit::Foot),
    ("_feet", Unit::Foot),
    ("_ft", Unit::Foot),
    ("(meters)", Unit::Metre),
    ("(m)", Unit::Metre),
    ("[m]", Unit::Metre),
    ("_m", Unit::Metre),
    ("_deg", Unit::Degree),
    ("(deg)", Unit::Degree),
    ("[deg]", Unit::Degree),
    ("(degrees)", Unit::Degree),
];
/// The international foot.
const FOOT_M: f64 = 0.3048;

/// Trajectories of the TUM form: time, position, orientation as a quaternion.
const TUM: usize = 8;

/// Columns that PX4's local position marks what it does not know with.
const VALID: [&str; 2] = ["xy_valid", "z_valid"];

/// Why a header has no place for a flight.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ColumnsError {
    /// No column of that name.
    #[error(
        "column `{name}` is missing from the header, which has {found}; --columns T,X,Y,Z names others"
    )]
    Missing {
        /// The column.
        name: String,
        /// What the header has instead.
        found: String,
    },
    /// A column is named twice.
    #[error("column `{0}` appears twice in the header")]
    Duplicate(String),
    /// The first line has numbers.
    #[error(
        "column `{0}` is missing: the first line holds numbers and no header such as timestamp,tx,ty,tz"
    )]
    NoHeader(String),
}

/// Where the four columns are.
#[derive(Clone, Debug)]
pub struct Columns {
    index: [usize; 4],
    titles: [String; 4],
    valid: Vec<usize>,
    assumed: bool,
    /// Unit that the time's name says.
    pub time_unit: Option<TimeUnit>,
    /// Frame that the positions' names say.
    pub frame: Option<Frame>,
}

impl Columns {
    /// The columns of `header`.
    ///
    /// # Errors
    /// See [`ColumnsError`].
    pub fn find(
        header: &Record,
        separator: Separator,
        options: &ReadOptions,
    ) -> Result<Self, ColumnsError> {
        let titles: Vec<String> = header.fields().map(str::to_lowercase).collect();
        let missing = |name: &str| {
            if header.fields().all(|field| field.parse::<f64>().is_ok()) {
                return ColumnsError::NoHeader(name.to_owned());
            }
            ColumnsError::Missing {
                name: name.to_owned(),
                found: header.list(separator),
            }
        };
        let place = |name: &str| unique(&titles, |title| title == name, name);
        let (index, time_unit, frame) = if let Some(names) = &options.columns {
            let mut index = [0; 4];
            for (index, name) in index.iter_mut().zip(&names.0) {
                *index = place(&name.to_lowercase())?.ok_or_else(|| missing(name))?;
            }
            let unit = time_name(&titles[index[0]]).and_then(|(_, unit)| unit);
            (index, unit, None)
        } else {
            let (time, unit) = find_time(&titles)?.ok_or_else(|| missing(TIMES[0]))?;
            let ([x, y, z], frame) = match find_position(&titles)? {
                Ok(found) => found,
                Err(name) => match find_geodetic(&titles)? {
                    Some(places) => (places, Some(Frame::Wgs84)),
                    None => return Err(missing(name)),
                },
            };
            ([time, x, y, z], unit, frame)
        };
        // As a message can hold it.
        let shown = |title: &str| title.escape_debug().to_string();
        let own = header.fields().map(shown).collect::<Vec<_>>();
        let valid = VALID.iter().filter_map(|name| place(name).ok().flatten());
        Ok(Self {
            index,
            titles: index.map(|index| own[index].clone()),
            valid: valid.collect(),
            assumed: false,
            time_unit,
            frame,
        })
    }

    /// The columns of a line of numbers that is a trajectory of the TUM form: seconds, x, y, z in metres, and
    /// four of a quaternion, blanks between them.
    pub(super) fn of_tum(
        record: &Record,
        separator: Separator,
        options: &ReadOptions,
    ) -> Option<Self> {
        let is_one = separator == Separator::Blank
            && options.columns.is_none()
            && !record.is_comment()
            && record.width() == TUM
            && record.fields().all(|field| field.parse::<f64>().is_ok());
        is_one.then(|| Self {
            index: [0, 1, 2, 3],
            titles: ["timestamp", "tx", "ty", "tz"].map(str::to_owned),
            valid: Vec::new(),
            assumed: true,
            time_unit: Some(TimeUnit::S),
            frame: Some(Frame::Enu),
        })
    }

    /// Whether there was no header to find them in.
    pub(super) fn is_assumed(&self) -> bool {
        self.assumed
    }

    /// Whether positions are latitude, longitude and height.
    pub(super) fn frame_is_geodetic(&self, options: &ReadOptions) -> bool {
        options.frame.or(self.frame) == Some(Frame::Wgs84)
    }

    /// Metres that one of a height is: those of a foot if its title says so.
    pub(super) fn height_unit_m(&self) -> f64 {
        match name_and_unit(&self.title(SampleField::Z).to_lowercase()) {
            (_, Some(Unit::Foot)) => FOOT_M,
            _ => 1.0,
        }
    }

    /// Whether heights count from the ground where the flight began.
    pub(super) fn is_above_ground(&self) -> bool {
        let title = self.title(SampleField::Z).to_lowercase();
        HEIGHTS.contains(&name_and_unit(&title).0)
    }

    /// Where `field` stands in a record.
    #[must_use]
    pub fn index(&self, field: SampleField) -> usize {
        self.index[field as usize]
    }

    /// The column's name in the file.
    #[must_use]
    pub fn title(&self, field: SampleField) -> &str {
        &self.titles[field as usize]
    }

    /// Whether `record` marks its own position as not known.
    pub(super) fn says_invalid(&self, record: &Record) -> bool {
        let said = |index: &usize| record.field(*index).to_ascii_lowercase();
        let mut marks = self.valid.iter().map(said);
        marks.any(|mark| matches!(mark.as_str(), "0" | "false"))
    }
}

/// The one title that `fits`.
fn unique(
    titles: &[String],
    fits: impl Fn(&str) -> bool,
    name: &str,
) -> Result<Option<usize>, ColumnsError> {
    let mut places = (0..titles.len()).filter(|index| fits(&titles[*index]));
    match (places.next(), places.next()) {
        (Some(_), Some(_)) => Err(ColumnsError::Duplicate(name.to_owned())),
        (place, _) => Ok(place),
    }
}

/// The time's column, and the unit in its name.
fn find_time(titles: &[String]) -> Result<Option<(usize, Option<TimeUnit>)>, ColumnsError> {
    for name in TIMES {
        let named = |title: &str| time_name(title).is_some_and(|(base, _)| base == name);
        // The plain name before one with a unit.
        let plain = unique(titles, |title| title == name, name)?;
        let place = match plain {
            Some(place) => Some(place),
            None => unique(titles, named, name)?,
        };
        if let Some(place) = place {
            let unit = time_name(&titles[place]).and_then(|(_, unit)| unit);
            return Ok(Some((place, unit)));
        }
    }
    Ok(None)
}

type Position = ([usize; 3], Option<Frame>);

/// The positions' columns, or the name of the one that is missing.
fn find_position(titles: &[String]) -> Result<Result<Position, &'static str>, ColumnsError> {
    let mut missing = (0, POSITIONS[0].0[0]);
    for (names, frame) in POSITIONS {
        let mut places = [None; 3];
        for (place, name) in places.iter_mut().zip(names) {
            *place = unique(titles, |title| without_metres(title) == name, name)?;
        }
        if let [Some(x), Some(y), Some(z)] = places {
            return Ok(Ok(([x, y, z], frame)));
        }
        // The names that are nearly there are the ones that were meant.
        let found = places.iter().flatten().count();
        let absent = places.iter().zip(names).find(|(place, _)| place.is_none());
        if let (true, Some((_, name))) = (found > missing.0, absent) {
            missing = (found, name);
        }
    }
    Ok(Err(missing.1))
}

/// The columns of latitude, longitude and height; heights above the ground before others.
fn find_geodetic(titles: &[String]) -> Result<Option<[usize; 3]>, ColumnsError> {
    let first = |names: &[&'static str]| {
        for name in names {
            let place = unique(titles, |title| name_and_unit(title).0 == *name, name)?;
            if place.is_some() {
                return Ok(place);
            }
        }
        Ok(None)
    };
    let heights: Vec<&str> = HEIGHTS.into_iter().chain(ALTITUDES).collect();
    let places = [first(&LATITUDES)?, first(&LONGITUDES)?, first(&heights)?];
    Ok(match places {
        [Some(latitude), Some(longitude), Some(height)] => Some([latitude, longitude, height]),
        _ => None,
    })
}

/// A position's name, and the unit behind it where its title has one.
fn name_and_unit(title: &str) -> (&str, Option<Unit>) {
    ENDINGS
        .iter()
        .find_map(|(ending, unit)| Some((title.strip_suffix(ending)?.trim_end(), Some(*unit))))
        .unwrap_or((title, None))
}

/// Base name and unit of a time's title: `time_us`, `timestamp [ms]`, `t(s)`, `time`.
fn time_name(title: &str) -> Option<(&str, Option<TimeUnit>)> {
    let base = TIMES.into_iter().find(|base| {
        let rest = title.strip_prefix(base);
        rest.is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
    })?;
    let rest = &title[base.len()..];
    let unit = rest.trim_matches(|c: char| c.is_whitespace() || "_.-/[]()".contains(c));
    if unit.is_empty() {
        return Some((base, None));
    }
    TimeUnit::spelt(unit).map(|unit| (base, Some(unit)))
}

/// A position's name; in other units than metres it is none.
fn without_metres(title: &str) -> &str {
    match name_and_unit(title) {
        (name, Some(Unit::Metre)) => name,
        _ => title,
    }
}
