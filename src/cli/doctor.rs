//! `rodsweep doctor`.
use super::{CommandError, Exit};
pub fn doctor() -> Result<Exit, CommandError> {
    Ok(Exit::Done)
}
