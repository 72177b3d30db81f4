//! Samples of a block by nodes.

use super::kernels::{ByNodes, FollowNodes, Kernels};
use super::memory::{Block, Memory, made};
use crate::cpu::multiple_shooting::Nodes;
use crate::cpu::rod::program::Outputs;

impl<L: Kernels> Block<'_, L> {
    /// Leads as many samples as a coarse register holds to their loads by nodes, quickly.
    #[inline(always)]
    pub(in crate::cpu) fn follow_nodes(&mut self, samples: &[usize]) {
        let Memory { paths: tools, quick, quick_end: end, .. } = &mut *self.memory;
        let (program, token) = (self.program, self.token);
        tools.pack(self.inputs, samples);
        let nodes = made(quick, || Nodes::new(token, program));
        L::Coarse::follow_nodes(FollowNodes { program, token, nodes, end, tools });
    }

    /// Solves samples by nodes, some of those that were led so, from the one at `offset` on.
    #[inline(always)]
    pub(in crate::cpu) fn solve_by_nodes(&mut self, samples: &[usize], offset: usize, out: Outputs<'_, L::Scalar>) {
        let Memory { answers: tools, nodes, quick, quick_end, .. } = &mut *self.memory;
        let (program, token) = (self.program, self.token);
        tools.pack(self.inputs, samples);
        let (nodes, quick) = (made(nodes, || Nodes::new(token, program)), made(quick, || Nodes::new(token, program)));
        L::by_nodes(ByNodes { program, token, nodes, quick, quick_end, offset, tools, out });
    }
}
