//! The report: one page that opens without a network, and its figures as files.

pub mod by_motion;
pub mod campaign_results;
mod figures;
pub mod forecasts;
mod html;
mod noise_table_name;
mod page;
pub mod results_json;
mod space;
mod suspected;
mod swatch;
pub mod table;

use crate::campaign::Campaign;
use crate::campaign::outcome::Outcome;
use crate::contest::example::Example;
use crate::contest::runtime::MethodTime;
use crate::method::Method;
use campaign_results::CampaignProvenance;

/// Methods that the example tracks show: more would be too many lines.
pub const SHOWN: [Method; 6] = [
    Method::Ekf,
    Method::EkfTuned,
    Method::Imm10,
    Method::Bnn,
    Method::Bnkf,
    Method::Recursive,
];

/// Everything that the page shows.
#[derive(Clone, Copy, Debug)]
pub struct Material<'a> {
    /// What was evaluated.
    pub campaign: &'a Campaign,
    /// What came out.
    pub outcome: &'a Outcome,
    /// What made it.
    pub provenance: &'a CampaignProvenance,
    /// One flight per noise level with the tracks of [`SHOWN`].
    pub examples: &'a [Example<'a>],
    /// What a step costs.
    pub times: &'a [MethodTime],
}

/// A file of the report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportFile {
    /// Name.
    pub name: String,
    /// Contents.
    pub text: String,
}

/// Name of the page.
pub const PAGE: &str = "report.html";

/// The page, [`PAGE`], and its figures.
pub fn files(material: &Material<'_>) -> Vec<ReportFile> {
    let figures = figures::draw(material);
    let mut files = vec![ReportFile {
        name: PAGE.to_owned(),
        text: page::page(material, &figures),
    }];
    files.extend(figures.into_iter().map(|figure| ReportFile {
        name: format!("{}.svg", figure.name),
        text: figure.svg,
    }));
    files
}
