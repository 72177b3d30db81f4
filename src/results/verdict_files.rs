//! Where verdicts lie: in the manifest of a run, and in a file each where shards or workers share a directory.
//!
//! Shards that end at the same moment each write their own file, so that none writes over what another has seen.

use super::error::ResultsError;
use super::manifest::Manifest;
use super::read::Results;
use super::store::{Store, store_at};
use super::verdict::Verdict;
use super::verdict_text::Solved;
use crate::input::write_scene;
use crate::spec::{Shard, SweepSpec};

const FOLDER: &str = "verdicts";

/// Name of the file of a shard.
pub(crate) fn of_shard(shard: Shard) -> String {
    format!("{FOLDER}/{}-of-{}.json", shard.index, shard.count)
}

/// Name of the file of a worker.
pub(crate) fn of_worker(id: &str) -> String {
    format!("{FOLDER}/{id}.json")
}

/// Puts a verdict of a part of the run.
pub(crate) fn put(store: &dyn Store, name: &str, verdict: &Verdict) -> Result<(), ResultsError> {
    let text = serde_json::to_string_pretty(verdict).unwrap_or_default() + "\n";
    store.put(name, text.as_bytes())
}

/// The verdict in a file; `None` where there is no such file.
pub(crate) fn get(store: &dyn Store, name: &str) -> Result<Option<Verdict>, ResultsError> {
    let Some(bytes) = store.get(name)? else { return Ok(None) };
    let damaged =
        |error: serde_json::Error| ResultsError::Damaged { path: store.path(name), reason: error.to_string() };
    serde_json::from_slice(&bytes).map(Some).map_err(damaged)
}

/// The verdicts of shards and workers, with the names of their files.
fn parts(store: &dyn Store) -> Result<Vec<(String, Verdict)>, ResultsError> {
    let mut parts = Vec::new();
    for entry in store.list(FOLDER)? {
        let name = format!("{FOLDER}/{}", entry.name);
        if entry.is_file && entry.name.ends_with(".json") {
            parts.extend(get(store, &name)?.map(|verdict| (name, verdict)));
        }
    }
    Ok(parts)
}

/// The verdict on all rows in a store; `None` where the store holds no verdict.
pub(crate) fn find(store: &dyn Store) -> Result<Option<Verdict>, ResultsError> {
    let manifest = Manifest::find(store)?;
    let parts = parts(store)?;
    if parts.is_empty() {
        return Ok(manifest.map(|manifest| manifest.verdict()));
    }
    let of_whole = manifest.filter(|manifest| manifest.run.as_ref().is_some_and(|run| run.shard == Shard::WHOLE));
    let mut all: Vec<Verdict> = parts.into_iter().map(|(_, verdict)| verdict).collect();
    all.extend(of_whole.map(|manifest| manifest.verdict()));
    Ok(Some(Verdict::sum(&all)))
}

/// Removes the verdicts of shards and workers, once the manifest of the whole run holds their sum.
pub(crate) fn clear(store: &dyn Store) -> Result<(), ResultsError> {
    parts(store)?.iter().try_for_each(|(name, _)| store.remove(name))
}

/// Writes the worst sample of each doubt as a scene that `solve` reads.
pub(crate) fn put_scenes(store: &dyn Store, spec: &SweepSpec, verdict: Option<&Verdict>) -> Result<(), ResultsError> {
    for doubt in verdict.iter().flat_map(|verdict| &verdict.doubts) {
        // An edited manifest may name a sample that does not exist.
        let Some(sample) = doubt.worst.filter(|sample| *sample < spec.sample_count) else { continue };
        let scene = spec.sample_scene(sample);
        // Values of which no rod can be made are a scene that `solve` refuses.
        if scene.validate().is_ok() {
            store.put(&doubt.scene_file(), write_scene(&scene).as_bytes())?;
        }
    }
    Ok(())
}

impl Results {
    /// The verdict on the rows, added up over the runs that wrote them; `None` where the directory holds none.
    ///
    /// # Errors
    ///
    /// A manifest that is damaged.
    pub fn verdict(&self) -> Result<Option<Verdict>, ResultsError> {
        find(store_at(self.directory())?.as_ref())
    }

    /// Doubts about the rows in words: where they lie and what helps; `None` where the rows are sound.
    ///
    /// # Errors
    ///
    /// As [`Results::verdict`].
    pub fn distrust(&self) -> Result<Option<String>, ResultsError> {
        let Some(verdict) = self.verdict()?.filter(|verdict| !verdict.sound) else { return Ok(None) };
        let run = self.manifest().ok().and_then(|manifest| manifest.run);
        let certain = run.and_then(|run| run.path_check).is_some_and(|check| check.all);
        let solved = Solved { method: self.method(), certain, place: Some(self.directory()) };
        Ok(Some(verdict.explain(&solved)))
    }
    /// A sentence where no verdict covers some of the rows, as after a run that was cut short before it wrote its manifest.
    ///
    /// # Errors
    ///
    /// As [`Results::verdict`], or a directory that cannot be listed.
    pub fn unchecked(&self) -> Result<Option<String>, ResultsError> {
        let (_, rows) = self.progress()?;
        let covered = self.verdict()?.map_or(0, |verdict| verdict.samples);
        Ok((covered < rows).then(|| {
            format!(
                "{} of {rows} samples were not checked, as far as manifest.json tells: their run has not ended, or was cut short; \
                 `run --resume` ends and checks it",
                rows - covered
            )
        }))
    }
}
