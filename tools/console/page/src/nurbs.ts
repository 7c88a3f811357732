// A membrane as vision reconstructs it (rt/station/surface.hpp): degree 3 from pole to pole, clamped; a rational quadratic
// circle round, made of nine control points. Round, the circle of the net is evaluated as what it is, a circle: the last
// point of a ring is its first, and there is no seam.
import type {Row} from './wire';

export const kAlong = 64, kRound = 40;  // of the mesh

// The four cubic B-splines that are not zero at u, with clamped knots 0 0 0 0 1 2 ... n-3 n-3 n-3 n-3; the first one's place.
export function cubicBasis(u: number, controlPoints: number): [first: number, values: number[]] {
  const spans = controlPoints - 3, span = Math.min(Math.max(Math.floor(u), 0), spans - 1);
  const knot = (i: number) => Math.min(Math.max(i - 3, 0), spans);
  const values = [1], left = [0], right = [0];
  for (let degree = 1; degree <= 3; degree++) {
    left[degree] = u - knot(span + 3 + 1 - degree);
    right[degree] = knot(span + 3 + degree) - u;
    let saved = 0;
    for (let r = 0; r < degree; r++) {
      const part = values[r]! / (right[r + 1]! + left[degree - r]!);
      values[r] = saved + right[r + 1]! * part;
      saved = left[degree - r]! * part;
    }
    values[degree] = saved;
  }
  return [span, values];
}

// Points of the surface, (kAlong + 1) rings of kRound, in the units of the net; x, y, z of the microscope's frame.
// A control point along stands for the circle middle + cos * radius in the picture, sin * depth out of it.
export function surfacePoints(rows: Row[], into: Float32Array, scale: number): void {
  for (let i = 0; i <= kAlong; i++) {
    const [first, weights] = cubicBasis((i / kAlong) * (rows.length - 3), rows.length);
    let mx = 0, my = 0, rx = 0, ry = 0, depth = 0;
    for (let k = 0; k < 4; k++) {
      const row = rows[first + k]!, w = weights[k]!;
      mx += w * row.middle_x_m;
      my += w * row.middle_y_m;
      rx += w * row.radius_x_m;
      ry += w * row.radius_y_m;
      depth += w * row.depth_m;
    }
    for (let j = 0; j < kRound; j++) {
      const angle = (2 * Math.PI * j) / kRound, c = Math.cos(angle), s = Math.sin(angle), at = 3 * (i * kRound + j);
      into[at] = scale * (mx + c * rx);
      into[at + 1] = scale * (my + c * ry);
      into[at + 2] = scale * s * depth;
    }
  }
}

// The same mesh from what is known without a net: a sphere, and the dimple that the needle makes at its entry point,
// as deep as w_d and of half-width a. axis: unit vector of the needle.
export function spherePoints(centre: [number, number, number], R: number, axis: [number, number, number], wd: number, a: number,
                             into: Float32Array, scale: number): void {
  // Two directions across the axis; the pole of the mesh lies where the needle comes from.
  const [ax, ay, az] = axis;
  const helper: [number, number, number] = Math.abs(az) < 0.9 ? [0, 0, 1] : [0, 1, 0];
  let px = ay * helper[2] - az * helper[1], py = az * helper[0] - ax * helper[2], pz = ax * helper[1] - ay * helper[0];
  const n = Math.hypot(px, py, pz);
  px /= n; py /= n; pz /= n;
  const qx = ay * pz - az * py, qy = az * px - ax * pz, qz = ax * py - ay * px;
  for (let i = 0; i <= kAlong; i++) {
    const polar = (Math.PI * i) / kAlong, across = R * Math.sin(polar);
    let along = -R * Math.cos(polar);
    if (a > 0 && across < a && polar < Math.PI / 2) along += wd * (1 - (across / a) ** 2) ** 2;
    for (let j = 0; j < kRound; j++) {
      const angle = (2 * Math.PI * j) / kRound, c = across * Math.cos(angle), s = across * Math.sin(angle), at = 3 * (i * kRound + j);
      into[at] = scale * (centre[0] + along * ax + c * px + s * qx);
      into[at + 1] = scale * (centre[1] + along * ay + c * py + s * qy);
      into[at + 2] = scale * (centre[2] + along * az + c * pz + s * qz);
    }
  }
}

export function meshIndex(): number[] {
  const index: number[] = [];
  for (let i = 0; i < kAlong; i++) {
    for (let j = 0; j < kRound; j++) {
      const a = i * kRound + j, b = i * kRound + ((j + 1) % kRound), c = a + kRound, d = b + kRound;
      index.push(a, c, b, b, c, d);
    }
  }
  return index;
}
