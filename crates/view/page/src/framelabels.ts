// d₁, d₂ and d₃ at the heads of the tip's directors, as in the figures: colour alone does not tell them apart for everybody.

import { el } from "./dom";
import type { RodView } from "./rodview";
import type { Stage } from "./stage";

const NAMES = ["d\u2081", "d\u2082", "d\u2083"];
/** Beyond the head (pixels). */
const GAP = 9;

export function labelFrame(stage: Stage, rod: RodView): void {
  const labels = NAMES.map((name) => el("span", {}, name));
  const host = el("div", { class: "axis-labels is-frame", "aria-hidden": "true" }, ...labels);
  stage.host.append(host);
  stage.onFrame(() => {
    const heads = rod.mesh.directorHeads();
    host.hidden = heads.length === 0 || !rod.mesh.group.visible;
    const [x, y] = stage.project(rod.mesh.tip.position);
    heads.forEach((head, k) => {
      const [u, v] = stage.project(head);
      const length = Math.hypot(u - x, v - y);
      // One that points at the reader would write over the tip.
      labels[k]!.hidden = length < 6;
      const share = length > 0 ? 1 + GAP / length : 1;
      labels[k]!.style.transform = `translate(${(x + (u - x) * share).toFixed(1)}px, ${(y + (v - y) * share).toFixed(1)}px) translate(-50%, -50%)`;
    });
  });
}
