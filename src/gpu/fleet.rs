//! Several GPUs that share the samples of a sweep, each as many as it is fast.

use super::device::{Device, failed, reason};
use super::engine::Gpu;
use super::split_by_weight::split_by_weight;
use crate::backend::{Backend, BackendError, BackendInfo, Precision, ReduceJob, Reduced, Returned, RungCount};
use crate::clock::Busy;
use crate::model::{BLOCK, Batch, Blocks, Plan, Solutions};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::{self, ScopedJoinHandle};
use std::time::Instant;

/// Engines for one plan that solve together. Where the adapters are alike, rows are those of any one of them.
pub struct Fleet {
    /// At least one.
    members: Vec<Member>,
    plan: Plan,
    info: BackendInfo,
    notes: Vec<String>,
}

struct Member {
    gpu: Gpu,
    /// From 1, as it was opened.
    number: usize,
    /// Samples a second; unknown before it has solved some.
    rate: Option<f64>,
}

/// One member's part of a sweep without rows.
struct Part {
    ranges: Vec<Range<u64>>,
    result: Result<Option<Reduced>, BackendError>,
    has_given: bool,
}

/// The GPU engine on every adapter that is to be taken, see [`Device::open_all`]. A backend for samples of the plan.
///
/// # Errors
///
/// `NoDevice`: none opens. Other errors are those of [`Gpu::new`], where it starts on none.
pub fn open(plan: &Plan, precision: Precision) -> Result<Box<dyn Backend>, BackendError> {
    let mut devices = Device::open_all()?;
    match devices.pop() {
        Some(only) if devices.is_empty() => Ok(Box::new(Gpu::new(only, plan, precision)?)),
        last => {
            devices.extend(last);
            Ok(Box::new(Fleet::new(devices, plan, precision)?))
        }
    }
}

impl Fleet {
    /// Prepares every device. Those on which the engine does not start are left out, and a note says so.
    ///
    /// # Errors
    ///
    /// Those of [`Gpu::new`] where it starts on none; `NoDevice` without devices.
    pub fn new(devices: Vec<Device>, plan: &Plan, precision: Precision) -> Result<Self, BackendError> {
        let (mut gpus, mut notes, mut refused) = (Vec::new(), Vec::new(), None);
        for device in devices {
            let name = device.adapter().name.clone();
            match Gpu::new(device, plan, precision) {
                Ok(gpu) => gpus.push(gpu),
                Err(error) => {
                    notes.push(format!("{name} is left out: {}", reason(&error)));
                    refused = Some(error);
                }
            }
        }
        match refused {
            Some(error) if gpus.is_empty() => Err(error),
            _ => Ok(Self { notes, ..Self::of(gpus)? }),
        }
    }

    /// Engines that were prepared for the same plan.
    ///
    /// # Errors
    ///
    /// `NoDevice` without engines.
    pub fn of(gpus: Vec<Gpu>) -> Result<Self, BackendError> {
        let first = gpus.first().ok_or_else(|| BackendError::NoDevice { reason: "none was named".into() })?;
        let (plan, info) = (first.plan().clone(), first.info());
        let member = |(number, gpu)| Member { gpu, number, rate: None };
        Ok(Self { members: (1..).zip(gpus).map(member).collect(), plan, info, notes: Vec::new() })
    }

    /// Shares of some ranges, one a member, by what each has shown; before that alike.
    fn shares(&self, ranges: &[Range<u64>]) -> Vec<Vec<Range<u64>>> {
        let known: Vec<f64> = self.members.iter().filter_map(|member| member.rate).collect();
        let usual = if known.is_empty() { 1.0 } else { known.iter().sum::<f64>() / known.len() as f64 };
        let weights: Vec<f64> = self.members.iter().map(|member| member.rate.unwrap_or(usual)).collect();
        split_by_weight(ranges, &weights)
    }

    /// Takes a member out; its notes stay.
    fn drop_out(&mut self, at: usize, error: &BackendError) {
        let mut member = self.members.remove(at);
        self.notes.extend(member.notes());
        self.notes.push(format!("{} drops out, the others take its share: {}", member.name(), reason(error)));
    }
}

impl Member {
    fn name(&self) -> String {
        format!("device {} ({})", self.number, self.gpu.device().adapter().name)
    }

    fn notes(&mut self) -> Vec<String> {
        let name = self.name();
        self.gpu.take_notes().iter().map(|note| format!("{name}: {note}")).collect()
    }

    fn learn(&mut self, samples: u64, start: Instant) {
        let rate = samples as f64 / start.elapsed().as_secs_f64().max(1e-9);
        self.rate = Some(self.rate.map_or(rate, |before| (before + rate) / 2.0));
    }

    /// Solves some blocks of a batch, range by range.
    fn solve(&mut self, batch: &Batch, blocks: &[Range<u64>]) -> Result<Vec<Solutions>, BackendError> {
        let start = Instant::now();
        let parts: Vec<Batch> = blocks.iter().map(|blocks| part(batch, blocks)).collect();
        let solved = parts.iter().map(|part| self.gpu.solve(part)).collect();
        let samples: usize = parts.iter().map(Batch::sample_count).sum();
        if samples > 0 {
            self.learn(samples as u64, start);
        }
        solved
    }

    /// Solves some samples of a sweep without rows.
    fn reduce(&mut self, job: &ReduceJob, ranges: Vec<Range<u64>>, give: &mut dyn FnMut(Returned) -> bool) -> Part {
        let (start, mut has_given) = (Instant::now(), false);
        let job = ReduceJob { ranges: &ranges, ..*job };
        let result = self.gpu.reduce(&job, &mut |returned| {
            has_given = true;
            give(returned)
        });
        if has_given {
            self.learn(ranges.iter().map(|range| range.end - range.start).sum(), start);
        }
        Part { ranges, result, has_given }
    }
}

/// Samples of some blocks.
fn part(batch: &Batch, blocks: &Range<u64>) -> Batch {
    let samples = BLOCK * blocks.start as usize..(BLOCK * blocks.end as usize).min(batch.sample_count());
    let mut inputs = Blocks::new(batch.inputs.column_count(), samples.len());
    inputs.data_mut().copy_from_slice(values(&batch.inputs, blocks));
    Batch { inputs, bad: batch.bad[samples].to_vec() }
}

fn places(blocks: &Blocks<f64>, range: &Range<u64>) -> Range<usize> {
    range.start as usize * blocks.block_len()..range.end as usize * blocks.block_len()
}

fn values<'a>(blocks: &'a Blocks<f64>, range: &Range<u64>) -> &'a [f64] {
    &blocks.data()[places(blocks, range)]
}

fn join<T>(thread: ScopedJoinHandle<T>) -> T {
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

impl Backend for Fleet {
    fn info(&self) -> BackendInfo {
        let infos: Vec<BackendInfo> = self.members.iter().map(|member| member.gpu.info()).collect();
        let joined = |what: fn(&BackendInfo) -> &str| infos.iter().map(what).collect::<Vec<_>>().join(" + ");
        let (device, driver) = match infos.iter().all(|info| *info == self.info) {
            true if infos.len() == 1 => (self.info.device.clone(), self.info.driver.clone()),
            true => (format!("{} x {}", infos.len(), self.info.device), self.info.driver.clone()),
            false => (joined(|info| &info.device), joined(|info| &info.driver)),
        };
        BackendInfo { device, driver, ..self.info.clone() }
    }

    fn plan(&self) -> &Plan {
        &self.plan
    }

    fn batch_size(&self) -> usize {
        self.members.iter().map(|member| member.gpu.batch_size()).sum()
    }

    fn solve(&mut self, batch: &Batch) -> Result<Solutions, BackendError> {
        let mut solutions = Solutions::new(&self.plan, batch.sample_count());
        let every_block = 0..batch.sample_count().div_ceil(BLOCK) as u64;
        let mut left = Vec::from([every_block]);
        while !left.is_empty() {
            let shares = self.shares(&left);
            let busy = &Busy::here();
            let solved: Vec<_> = thread::scope(|scope| {
                let threads: Vec<_> = (self.members.iter_mut().zip(&shares))
                    .map(|(member, share)| {
                        scope.spawn(move || {
                            let _busy = busy.enter();
                            member.solve(batch, share)
                        })
                    })
                    .collect();
                threads.into_iter().map(join).collect()
            });
            left.clear();
            for (at, (share, solved)) in shares.iter().zip(solved).enumerate().rev() {
                match solved {
                    Ok(parts) => {
                        for (blocks, part) in share.iter().zip(parts) {
                            let to = places(&solutions.values, blocks);
                            solutions.values.data_mut()[to].copy_from_slice(part.values.data());
                        }
                    }
                    Err(error) if self.members.len() == 1 => return Err(error),
                    Err(error) => {
                        self.drop_out(at, &error);
                        left.extend(share.iter().cloned());
                    }
                }
            }
        }
        Ok(solutions)
    }

    /// Every member takes its share of the samples. One that fails before it has given rows drops out; rows that were
    /// given cannot be taken back.
    fn reduce(
        &mut self,
        job: &ReduceJob,
        give: &mut dyn FnMut(Returned) -> bool,
    ) -> Result<Option<Reduced>, BackendError> {
        let mut voxels: HashMap<[i32; 3], u32> = HashMap::new();
        let mut left = job.ranges.to_vec();
        let (goes_on, given) = (AtomicBool::new(true), AtomicU64::new(0));
        while !left.is_empty() {
            let (sender, receiver) = sync_channel::<Returned>(self.members.len());
            let shares = self.shares(&left);
            let busy = &Busy::here();
            let parts: Vec<Part> = thread::scope(|scope| {
                let threads: Vec<_> = (self.members.iter_mut().zip(shares))
                    .map(|(member, share)| {
                        let (sender, goes_on) = (sender.clone(), &goes_on);
                        let mut pass_on =
                            move |returned| goes_on.load(Ordering::Relaxed) && sender.send(returned).is_ok();
                        scope.spawn(move || {
                            let _busy = busy.enter();
                            member.reduce(job, share, &mut pass_on)
                        })
                    })
                    .collect();
                drop(sender);
                for returned in receiver {
                    given.fetch_add(1, Ordering::Relaxed);
                    if !give(returned) {
                        goes_on.store(false, Ordering::Relaxed);
                    }
                }
                threads.into_iter().map(join).collect()
            });
            left.clear();
            for (at, Part { ranges, result, has_given }) in parts.into_iter().enumerate().rev() {
                match result {
                    Ok(Some(Reduced::Voxels(more))) => {
                        for (cell, count) in more {
                            let all = voxels.entry(cell).or_default();
                            *all = all.saturating_add(count);
                        }
                    }
                    // What one declines, those like it decline, too.
                    Ok(declined) if given.load(Ordering::Relaxed) == 0 => return Ok(declined),
                    Ok(_) => return Err(failed("devices differ in what they can count: name those that are alike")),
                    Err(error) if has_given || self.members.len() == 1 => return Err(error),
                    Err(error) => {
                        self.drop_out(at, &error);
                        left.extend(ranges);
                    }
                }
            }
        }
        Ok(Some(Reduced::Voxels(voxels)))
    }

    fn take_notes(&mut self) -> Vec<String> {
        let mut notes = std::mem::take(&mut self.notes);
        self.members.iter_mut().for_each(|member| notes.extend(member.notes()));
        notes
    }

    /// Summed over the devices, which work at once.
    fn timings(&self) -> Vec<(&'static str, f64)> {
        let mut sums: Vec<(&'static str, f64)> = Vec::new();
        for (at, (name, seconds)) in
            self.members.iter().flat_map(|member| member.gpu.timings().named().into_iter().enumerate())
        {
            match sums.get_mut(at) {
                Some((_, sum)) => *sum += seconds,
                None => sums.push((name, seconds)),
            }
        }
        sums
    }

    fn rungs(&self) -> Vec<RungCount> {
        let mut sums: Vec<RungCount> = Vec::new();
        for one in self.members.iter().flat_map(|member| member.gpu.rungs()) {
            match sums.iter_mut().find(|sum| sum.rung == one.rung) {
                Some(sum) => {
                    sum.samples += one.samples;
                    sum.left += one.left;
                    sum.seconds += one.seconds;
                }
                None => sums.push(one),
            }
        }
        sums
    }
}
