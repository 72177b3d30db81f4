// An arrow in space.

import { ConeGeometry, CylinderGeometry, Group, Mesh, MeshLambertMaterial, Quaternion, Vector3 } from "three";

export class Arrow {
  readonly group = new Group();
  private readonly shaft: Mesh;
  private readonly head: Mesh;

  constructor(
    colour: string,
    private readonly radius: number,
  ) {
    const material = new MeshLambertMaterial({ color: colour });
    this.shaft = new Mesh(new CylinderGeometry(1, 1, 1, 10).translate(0, 0.5, 0), material);
    this.head = new Mesh(new ConeGeometry(1, 1, 14).translate(0, 0.5, 0), material);
    this.group.add(this.shaft, this.head);
  }

  point(from: Vector3, vector: Vector3): void {
    const length = vector.length();
    this.group.visible = length > 0;
    if (length === 0) return;
    const head = Math.min(5 * this.radius, 0.5 * length);
    this.group.position.copy(from);
    this.group.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), vector.clone().normalize()));
    this.shaft.scale.set(this.radius, length - head, this.radius);
    this.head.scale.set(0.45 * head, head, 0.45 * head);
    this.head.position.y = length - head;
  }
}
