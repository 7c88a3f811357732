// Reads the messages of tools/wire/station.proto. The tables are made of that file when the page is built.
import {messages, enums} from 'wire-schema';

export interface Vector { x: number; y: number; z: number }
export interface Telemetry {
  tick: number; t_s: number; phase: number; fault: number; stop: number; alarms: number; cell: number;
  x_m?: Vector; v_m_s?: Vector; tip_m?: Vector; cmd_m?: Vector; force_N?: Vector; entry_m?: Vector; axis?: Vector;
  effect_N: number[]; contact_force_N: Vector[];
  guard_N: number; wd_m: number; a_m: number; R_m: number; tip_force_N: number; obs_age_s: number; injector_open: boolean;
  buttons: number; pressure_Pa: number; obs_gap_m: number; sensor_N: number; vacuum_Pa: number; injected_energy_J: number;
}
export interface Ticks { sample: Telemetry[]; lost: number }
export interface Observation {
  frame: number; holder_ok: boolean; tip_ok: boolean; outer_ok: boolean; inner_ok: boolean; contact: boolean; punctured: boolean;
  tip_m?: Vector; axis?: Vector; holder_m?: Vector; centre_m?: Vector; entry_m?: Vector;
  R_m: number; R_inner_m: number; wd_m: number; a_m: number; gap_m: number;
  R_sd_m: number; wd_sd_m: number; a_sd_m: number; noise_m: number;
}
export interface PictureContour { x_px: number[]; y_px: number[]; sd_px: number[] }
export interface Picture {
  frame: number; width: number; height: number; grey: Uint8Array; step_px: number; pixel_m: number;
  outer?: PictureContour; inner?: PictureContour;
}
export interface Row { middle_x_m: number; middle_y_m: number; radius_x_m: number; radius_y_m: number; depth_m: number }
export interface CellSurface { frame: number; outer?: {row: Row[]}; inner?: {row: Row[]} }
// JSON: what of the scene's guidance has a shape. Lengths in metres.
export interface Fixtures {
  cone?: {alpha_rad: number}; needle?: {tip_radius_m: number; shaft_radius_m: number; taper_m: number};
  floor?: {z_m: number}; holder?: {mouth_m: [number, number, number]; axis: [number, number, number]; radius_m: number};
}
export interface Event {
  tick: number; t_s: number; kind: number; value: number; target: number; writer: number;
  fault?: number; alarm?: number; phase?: number; command?: number; end?: number;
}

type Value = number | boolean | string | object;

// A 64-bit number as far as a double holds it; none here is larger but in a defective message.
function varint(bytes: DataView, at: number): [number, number] {
  let value = 0, factor = 1;
  for (let i = 0; i < 10; i++) {
    const byte = bytes.getUint8(at++);
    value += (byte & 0x7f) * factor;
    factor *= 128;
    if (byte < 0x80) return [value, at];
  }
  throw new RangeError('a number without an end');
}

function empty(name: string): Record<string, Value | Value[] | undefined> {
  const made: Record<string, Value | Value[] | undefined> = {};
  for (const [field, type, repeated] of Object.values(messages[name]!)) {
    made[field] = repeated ? [] : messages[type] ? undefined : type === 'string' ? '' : type === 'bool' ? false : type === 'bytes' ? new Uint8Array() : 0;
  }
  return made;
}

// Absent numbers are 0, absent messages undefined; what is not in the schema is skipped. Throws on bytes that end too early.
export function decode<T>(name: string, bytes: DataView): T {
  const fields = messages[name]!, made = empty(name);
  // Which member of a oneof there is, is told by its presence.
  if (name === 'Event') for (const one of ['fault', 'alarm', 'phase', 'command', 'end', 'unknown']) made[one] = undefined;
  for (let at = 0; at < bytes.byteLength;) {
    let key: number, length = 0;
    [key, at] = varint(bytes, at);
    const wire = key & 7, field = fields[Math.floor(key / 8)];
    let value: Value | Value[] = 0;
    if (wire === 0) {
      [value, at] = varint(bytes, at);
      if (field?.[1] === 'bool') value = value !== 0;
    } else if (wire === 1) {
      value = bytes.getFloat64(at, true);
      at += 8;
    } else if (wire === 5) {
      value = bytes.getFloat32(at, true);
      at += 4;
    } else if (wire === 2) {
      [length, at] = varint(bytes, at);
      if (at + length > bytes.byteLength) throw new RangeError('a field that ends too late');
      const part = new DataView(bytes.buffer, bytes.byteOffset + at, length);
      at += length;
      if (!field) continue;
      if (messages[field[1]]) value = decode<object>(field[1], part);
      else if (field[1] === 'string') value = new TextDecoder().decode(part);
      else if (field[1] === 'bytes') value = new Uint8Array(part.buffer, part.byteOffset, length);
      else value = packed(field[1], part);
    } else {
      throw new RangeError('a field of an unknown kind');
    }
    if (!field) continue;
    if (!field[2]) made[field[0]] = value;
    else if (Array.isArray(value)) (made[field[0]] as Value[]).push(...value);
    else (made[field[0]] as Value[]).push(value);
  }
  return made as T;
}

function packed(type: string, bytes: DataView): number[] {
  const list: number[] = [];
  for (let at = 0; at < bytes.byteLength;) {
    if (type === 'double') {
      list.push(bytes.getFloat64(at, true));
      at += 8;
    } else {
      let value: number;
      [value, at] = varint(bytes, at);
      list.push(value);
    }
  }
  return list;
}

// The word of an enumerator: FAULT_ESTOP_LOST of Fault is "estop lost".
export function word(type: string, value: number): string {
  const prefix = type.replace(/^.*\./, '').replace(/([a-z])([A-Z])/g, '$1_$2').toUpperCase() + '_';
  const name = enums[type]?.[value];
  return name === undefined ? `unknown (${value})` : name.replace(prefix, '').toLowerCase().replaceAll('_', ' ');
}
