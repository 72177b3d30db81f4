// A film that is clear from the front and dense at its outline, so that its form is seen and what is in it keeps its colour.

import { DoubleSide, MeshLambertMaterial, Plane } from "three";

export function film(clippingPlanes: Plane[]): MeshLambertMaterial {
  const material = new MeshLambertMaterial({ transparent: true, side: DoubleSide, depthWrite: false, clippingPlanes });
  material.onBeforeCompile = (shader) => {
    const end = "#include <dithering_fragment>";
    const rim = "gl_FragColor.a = 0.07 + 0.5 * pow(1.0 - abs(normal.z), 2.5);";
    shader.fragmentShader = shader.fragmentShader.replace(end, `${rim}\n${end}`);
  };
  return material;
}
