//! A workspace.
#![allow(unsafe_code)]

use super::place::{BnkfWorkspace, make};
use super::status::{BnkfStatus, said};
use crate::workspace::Workspace;

/// Makes a workspace.
///
/// # Safety
/// `workspace` is room for a workspace that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bnkf_workspace_init(workspace: *mut BnkfWorkspace) -> BnkfStatus {
    // SAFETY: by contract.
    said(unsafe { make(workspace, const { Workspace::new() }) })
}
