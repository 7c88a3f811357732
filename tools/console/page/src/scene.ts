// The scene under the microscope, in micrometres: needle, holding pipette, membranes, cone, axis, forces.
import * as THREE from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';
import {Headset} from './headset';
import {kAlong, kRound, meshIndex, spherePoints, surfacePoints} from './nurbs';
import type {CellSurface, Fixtures, Observation, Telemetry, Vector} from './wire';

const kUm = 1e6;
// Drawn sizes of what the station does not tell.
const kNeedleLength_um = 400, kHolderRadius_um = 40, kHolderLength_um = 300;
const kConeLength_um = 60, kConeAngle = Math.PI / 6;
const kNeedle = {tip_radius_m: 4e-6, shaft_radius_m: 14e-6, taper_m: 400e-6};
export const kNotTold: Fixtures = {cone: {alpha_rad: kConeAngle}};
const kFloor_um = 600, kFloorLines = 12;
const kZooms = [0.2, 20] as const, kPan_um = 150;
const kLongestArrow_um = 90, kArrow_um_per_uN = 20;

export interface Colours {
  background: string; outer: string; inner: string; needle: string; holder: string; guide: string; force: string; tip: string; forbidden: string;
}

// Microscope frame (x right, y down, z away) as three.js has it (x right, y up, z towards).
const place = (v: Vector) => new THREE.Vector3(v.x * kUm, -v.y * kUm, -v.z * kUm);
const direction = (v: Vector) => new THREE.Vector3(v.x, -v.y, -v.z).normalize();
const finite = (v?: Vector): v is Vector => v !== undefined && Number.isFinite(v.x + v.y + v.z);

interface View { name: string; camera: THREE.PerspectiveCamera | THREE.OrthographicCamera; orbit: OrbitControls }

export class SceneView {
  readonly drawn = {outer: 'nothing', inner: 'nothing', forbidden: '', coneAngle: kConeAngle, arrows: 0, views: 1, frames: 0, old: false};
  private renderer: THREE.WebGLRenderer;
  private scene = new THREE.Scene();
  private free = new THREE.PerspectiveCamera(35, 1, 1, 20000);
  private views: View[];
  private shown = 0;  // 0: all four; 1 ..: one
  private membranes: Record<'outer' | 'inner', THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>>;
  private needle = new THREE.Group();
  private needleGlass: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
  private tipMark: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  private holder: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
  private cone: THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private axisLine: THREE.Line<THREE.BufferGeometry, THREE.LineDashedMaterial>;
  private forbidden = new THREE.Group();  // floor and holder that the needle is kept from
  private hasCone = true;
  private rim_um = 0;
  private arrows: THREE.ArrowHelper[] = [];
  private dirty = true;
  private cellIsNew = true;
  private follows = false;
  private old_s?: number;
  private tip = new THREE.Vector3();
  private newest?: Telemetry;
  private seen?: Observation;
  private reconstructed?: CellSurface;
  private headsetOn?: Headset;
  private fence: WebGLSync | null = null;  // behind what render() told last

  constructor(private canvas: HTMLCanvasElement, private labels: HTMLElement, private colours: Colours) {
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, powerPreference: 'low-power'});
    const standard = () => new THREE.MeshStandardMaterial({roughness: 0.5, metalness: 0, side: THREE.DoubleSide});
    const membrane = (opacity: number, order: number) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * (kAlong + 1) * kRound), 3));
      geometry.setIndex(meshIndex());
      const material = standard();
      material.transparent = true;
      material.opacity = opacity;
      material.depthWrite = false;
      const mesh = new THREE.Mesh(geometry, material);
      mesh.renderOrder = order;
      mesh.frustumCulled = false;
      mesh.visible = false;
      this.scene.add(mesh);
      return mesh;
    };
    this.membranes = {inner: membrane(0.5, 1), outer: membrane(0.2, 2)};

    this.needleGlass = new THREE.Mesh(new THREE.BufferGeometry(), standard());
    this.tipMark = new THREE.Mesh(new THREE.SphereGeometry(3, 16, 12), new THREE.MeshBasicMaterial());
    this.needle.add(this.needleGlass, this.tipMark);
    const pipette = new THREE.CylinderGeometry(kHolderRadius_um, kHolderRadius_um, kHolderLength_um, 32, 1, true);
    pipette.translate(0, -kHolderLength_um / 2, 0);
    this.holder = new THREE.Mesh(pipette, standard());
    this.holder.material.transparent = true;
    this.holder.material.opacity = 0.5;
    const cone = new THREE.ConeGeometry(kConeLength_um * Math.tan(kConeAngle), kConeLength_um, 24, 1, true);
    cone.rotateX(Math.PI);
    cone.translate(0, kConeLength_um / 2, 0);  // its apex at the origin
    this.cone = new THREE.LineSegments(new THREE.WireframeGeometry(cone), new THREE.LineBasicMaterial({transparent: true, opacity: 0.5}));
    const line = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(0, -250, 0), new THREE.Vector3(0, 250, 0)]);
    this.axisLine = new THREE.Line(line, new THREE.LineDashedMaterial({dashSize: 8, gapSize: 6}));
    this.axisLine.computeLineDistances();
    for (const thing of [this.needle, this.holder, this.cone, this.axisLine]) {
      thing.visible = false;
      this.scene.add(thing);
    }
    this.scene.add(this.forbidden);
    for (let i = 0; i < 5; i++) {
      const arrow = new THREE.ArrowHelper(new THREE.Vector3(1, 0, 0), new THREE.Vector3(), 10);
      arrow.visible = false;
      arrow.renderOrder = 3;
      this.arrows.push(arrow);
      this.scene.add(arrow);
    }
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x777777, 2.2));
    const lamp = new THREE.DirectionalLight(0xffffff, 1.6);
    lamp.position.set(-300, 500, 800);
    this.scene.add(lamp);

    this.free.position.set(220, 180, 520);
    const view = (name: string, camera: View['camera']): View => {
      const orbit = new OrbitControls(camera, canvas);
      orbit.addEventListener('change', () => { this.dirty = true; });
      return {name, camera, orbit};
    };
    const flat = (name: string, x: number, y: number, z: number, up: [number, number, number]): View => {
      const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 1, 20000);
      camera.position.set(x, y, z);
      camera.up.set(...up);
      const made = view(name, camera);
      made.orbit.enableRotate = false;
      made.orbit.mouseButtons.LEFT = THREE.MOUSE.PAN;
      made.orbit.touches.ONE = THREE.TOUCH.PAN;
      [made.orbit.minZoom, made.orbit.maxZoom] = kZooms;
      return made;
    };
    this.views = [
      view('free', this.free),
      flat('microscope', 0, 0, 2000, [0, 1, 0]),
      flat('from above', 0, 2000, 0, [0, 0, -1]),
      flat('along the needle', 2000, 0, 0, [0, 1, 0]),
    ];
    this.show(1);
    this.paint(colours);
    this.fixtures(kNotTold);
  }

  paint(colours: Colours): void {
    this.scene.background = new THREE.Color(colours.background);
    for (const which of ['outer', 'inner'] as const) {
      const material = this.membranes[which].material;
      const colour = this.old_s === undefined ? colours[which] : colours.guide;
      material.color.set(colour);
      material.emissive.set(colour).multiplyScalar(0.55);
    }
    this.needleGlass.material.color.set(colours.needle);
    this.tipMark.material.color.set(colours.tip);
    this.holder.material.color.set(this.old_s === undefined ? colours.holder : colours.guide);
    this.holder.material.opacity = this.old_s === undefined ? 0.5 : 0.2;
    this.cone.material.color.set(colours.guide);
    this.axisLine.material.color.set(colours.guide);
    this.colours = colours;
    for (const region of this.forbidden.children) (region as THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>).material.color.set(colours.forbidden);
    for (const arrow of this.arrows) arrow.setColor(colours.force);
    this.dirty = true;
  }

  // 0: four views at once; 1 to 4: one of them.
  show(view: number): void {
    this.shown = view;
    this.drawn.views = view === 0 ? 4 : 1;
    this.views.forEach((one, i) => { one.orbit.enabled = i === Math.max(view, 1) - 1; });
    const names = view === 0 ? this.views : [this.views[view - 1]!];
    this.labels.replaceChildren(...names.map((one) => {
      const label = document.createElement('span');
      label.textContent = one.name + (this.old_s === undefined ? '' : `; cell and holder as they were ${this.old_s.toFixed(1)} s ago`);
      return label;
    }));
    this.labels.classList.toggle('four', view === 0);
    this.dirty = true;
  }

  // How old is what vision saw, where that is too old to be taken for now.
  age(old_s: number | undefined): void {
    if (old_s?.toFixed(1) === this.old_s?.toFixed(1)) return;
    this.old_s = old_s;
    this.drawn.old = old_s !== undefined;
    this.show(this.shown);
    this.paint(this.colours);
  }

  follow(on: boolean): void {
    this.follows = on;
    if (!on) for (const one of this.views.slice(1)) this.lookAt(one, new THREE.Vector3());
    this.dirty = true;
  }
  private lookAt(one: View, target: THREE.Vector3): void {
    one.camera.position.add(target).sub(one.orbit.target);
    one.orbit.target.copy(target);
  }
  private get led(): View { return this.views[Math.max(this.shown, 1) - 1]!; }

  // Where the free view looks from, as a link has it: degrees around and from the zenith, micrometres away.
  get viewpoint(): string {
    const place = new THREE.Spherical().setFromVector3(this.free.position.clone().sub(this.views[0]!.orbit.target));
    return [THREE.MathUtils.radToDeg(place.theta), THREE.MathUtils.radToDeg(place.phi), place.radius].map((v) => v.toFixed(0)).join('_');
  }
  lookFrom(viewpoint: string): void {
    const [around, down, far] = viewpoint.split('_').map(Number), target = this.views[0]!.orbit.target;
    if (!Number.isFinite(around! + down! + far!) || far! <= 0) return;
    const [theta, phi] = [THREE.MathUtils.degToRad(around!), THREE.MathUtils.degToRad(Math.min(Math.max(down!, 3), 177))];
    this.free.position.setFromSpherical(new THREE.Spherical(far, phi, theta)).add(target);
    this.dirty = true;
  }

  // What is seen flat is moved instead.
  turn(around: number, up: number): void {
    const {camera, orbit} = this.led;
    if (camera instanceof THREE.OrthographicCamera) {
      this.lookAt(this.led, new THREE.Vector3(around, -up, 0).multiplyScalar(kPan_um / camera.zoom).applyQuaternion(camera.quaternion).add(orbit.target));
      this.dirty = true;
      return;
    }
    const from = this.free.position.clone().sub(orbit.target);
    const place = new THREE.Spherical().setFromVector3(from);
    place.theta += around;
    place.phi = Math.min(Math.max(place.phi + up, 0.05), Math.PI - 0.05);
    this.free.position.setFromSpherical(place).add(orbit.target);
    orbit.update();
    this.dirty = true;
  }

  zoom(factor: number): void {
    const {camera, orbit} = this.led;
    if (camera instanceof THREE.OrthographicCamera) camera.zoom = Math.min(Math.max(camera.zoom / factor, kZooms[0]), kZooms[1]);
    else camera.position.sub(orbit.target).multiplyScalar(factor).add(orbit.target);
    this.dirty = true;
  }

  telemetry(t: Telemetry): void {
    this.newest = t;
    this.dirty = true;
  }
  observation(o: Observation): void {
    this.seen = o;
    this.cellIsNew = true;
    this.dirty = true;
  }
  surface(s: CellSurface): void {
    this.reconstructed = s;
    this.cellIsNew = true;
    this.dirty = true;
  }

  // Shapes that the station tells.
  fixtures(f: Fixtures): void {
    const needle = f.needle ?? kNeedle;
    const tip = needle.tip_radius_m * kUm, shaft = needle.shaft_radius_m * kUm, taper = Math.min(needle.taper_m * kUm, kNeedleLength_um);
    this.rim_um = tip;
    this.needleGlass.geometry.dispose();
    // Along y, the tip at the origin and the glass behind it.
    this.needleGlass.geometry = new THREE.LatheGeometry([[0, 0], [tip, 0], [shaft, -taper], [shaft, -kNeedleLength_um]].map(([x, y]) => new THREE.Vector2(x, y)), 24);
    this.hasCone = f.cone !== undefined;
    if (f.cone) {
      const wider = Math.tan(f.cone.alpha_rad) / Math.tan(kConeAngle);
      this.cone.scale.set(wider, 1, wider);
      this.drawn.coneAngle = f.cone.alpha_rad;
    }
    this.forbidden.clear();
    if (f.floor) {
      const floor = new THREE.GridHelper(kFloor_um, kFloorLines);
      floor.geometry.deleteAttribute('color');
      floor.material = new THREE.LineBasicMaterial({transparent: true, opacity: 0.4});
      floor.rotation.x = Math.PI / 2;
      floor.position.z = -f.floor.z_m * kUm;
      this.forbidden.add(floor);
    }
    if (f.holder) {
      const radius = f.holder.radius_m * kUm, body = new THREE.CylinderGeometry(radius, radius, kHolderLength_um, 16, 4, true);
      body.translate(0, kHolderLength_um / 2, 0);
      const holder = new THREE.LineSegments(new THREE.WireframeGeometry(body), new THREE.LineBasicMaterial({transparent: true, opacity: 0.25}));
      const [mouth, axis] = [f.holder.mouth_m, f.holder.axis].map(([x, y, z]) => ({x, y, z}));
      holder.position.copy(place(mouth!));
      holder.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), direction(axis!));
      this.forbidden.add(holder);
    }
    this.drawn.forbidden = [f.floor && 'floor', f.holder && 'holder'].filter(Boolean).join();
    this.paint(this.colours);
  }

  headset(text: () => [string, boolean], stop: () => void, changed: () => void): Headset {
    this.headsetOn = new Headset(this.renderer, this.scene, this.free, () => this.arrange(), text, stop, () => {
      this.dirty = true;
      changed();
    });
    return this.headsetOn;
  }

  // Whether the graphics processor, or what stands in for it, is through with what render() told it: it may lie seconds behind.
  get isDrawn(): boolean {
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    if (this.fence !== null && gl.getSyncParameter(this.fence, gl.SYNC_STATUS) === gl.UNSIGNALED) return false;
    gl.deleteSync(this.fence);
    this.fence = null;
    return true;
  }
  // False: nothing is new, or nothing of it is seen.
  render(): boolean {
    if (!this.tell()) return false;
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    return true;
  }

  private tell(): boolean {
    if (this.headsetOn?.isOn) return false;  // which draws by itself
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    const ratio = Math.min(devicePixelRatio, 2);
    if (width === 0 || height === 0) return false;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height, false);
      this.dirty = true;
    }
    if (!this.dirty) return false;
    this.dirty = false;
    this.arrange();
    this.drawn.frames++;
    if (this.shown !== 0) {
      this.draw(this.views[this.shown - 1]!, 0, 0, width, height);
      return true;
    }
    const w = Math.floor(width / 2), h = Math.floor(height / 2);
    this.views.forEach((view, i) => this.draw(view, (i % 2) * (w + 1), i < 2 ? h + 1 : 0, w - 1, h - 1));
    return true;
  }

  private draw(view: View, x: number, y: number, width: number, height: number): void {
    const camera = view.camera;
    if (this.follows) this.lookAt(view, this.tip);
    if (camera instanceof THREE.PerspectiveCamera) camera.aspect = width / height;
    else {
      const half = this.follows ? 70 : 170, aspect = width / height;
      camera.left = -half * Math.max(aspect, 1);
      camera.right = half * Math.max(aspect, 1);
      camera.top = half / Math.min(aspect, 1);
      camera.bottom = -half / Math.min(aspect, 1);
    }
    camera.lookAt(view.orbit.target);
    camera.updateProjectionMatrix();
    this.renderer.setScissorTest(true);
    this.renderer.setViewport(x, y, width, height);
    this.renderer.setScissor(x, y, width, height);
    this.renderer.render(this.scene, camera);
  }

  private arrange(): void {
    const t = this.newest, o = this.seen;
    // What vision sees lies in the microscope's frame, what the core tells in the stage's: both know the entry point.
    const shift: Vector = t && o && finite(t.entry_m) && finite(o.entry_m) && o.outer_ok && t.obs_age_s >= 0
      ? {x: t.entry_m.x - o.entry_m.x, y: t.entry_m.y - o.entry_m.y, z: t.entry_m.z - o.entry_m.z}
      : {x: 0, y: 0, z: 0};
    const far = Math.hypot(shift.x, shift.y, shift.z) > 100e-6;
    const moved = far ? new THREE.Vector3() : place(shift);
    const axis = t && finite(t.axis) && Math.hypot(t.axis.x, t.axis.y, t.axis.z) > 0.5 ? t.axis : {x: -1, y: 0, z: 0};
    const along = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), direction(axis));

    this.needle.visible = finite(t?.tip_m);
    if (t && finite(t.tip_m)) {
      this.tip.copy(place(t.tip_m));
      this.needle.position.copy(this.tip);
      this.needle.quaternion.copy(along);
    }
    const knowsEntry = t !== undefined && finite(t.entry_m) && t.obs_age_s >= 0;
    this.axisLine.visible = knowsEntry;
    this.cone.visible = this.hasCone && knowsEntry && t.phase <= 2;
    if (knowsEntry && t.entry_m) {
      for (const guide of [this.axisLine, this.cone]) {
        guide.position.copy(place(t.entry_m));
        // The cone opens towards the needle.
        guide.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), direction(axis).negate());
      }
    }
    this.holder.visible = o !== undefined && o.holder_ok && finite(o.holder_m);
    if (o && this.holder.visible && finite(o.holder_m)) {
      this.holder.position.copy(place(o.holder_m)).add(moved);
      // It holds the cell from the side that is opposite to the needle.
      this.holder.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), direction(axis).negate());
    }
    if (this.cellIsNew) {
      this.drawn.outer = this.membrane('outer', axis);
      this.drawn.inner = this.membrane('inner', axis);
      this.cellIsNew = false;
    }
    for (const mesh of Object.values(this.membranes)) mesh.position.copy(moved);
    this.forces(t);
  }

  private membrane(which: 'outer' | 'inner', axis: Vector): string {
    const mesh = this.membranes[which], o = this.seen, net = this.reconstructed?.[which];
    const position = mesh.geometry.getAttribute('position') as THREE.BufferAttribute;
    const R = which === 'outer' ? o?.R_m : o?.R_inner_m;
    let drawn = 'nothing';
    if (net && net.row.length >= 8 && net.row.every((row) => Number.isFinite(row.middle_x_m + row.middle_y_m + row.radius_x_m + row.radius_y_m + row.depth_m))) {
      surfacePoints(net.row, position.array as Float32Array, kUm);
      drawn = 'surface';
    } else if (o && (which === 'outer' ? o.outer_ok : o.inner_ok) && R && Number.isFinite(R) && finite(o.centre_m)) {
      const gap = which === 'inner' ? Math.max(o.R_m - R, 0) : 0;
      spherePoints([o.centre_m.x, o.centre_m.y, o.centre_m.z], R, [axis.x, axis.y, axis.z], Math.max(o.wd_m - gap, 0), o.a_m,
                   position.array as Float32Array, kUm);
      drawn = 'radius';
    }
    mesh.visible = drawn !== 'nothing';
    if (mesh.visible) {
      const array = position.array as Float32Array;
      for (let i = 1; i < array.length; i += 3) {
        array[i] = -array[i]!;
        array[i + 1] = -array[i + 1]!;
      }
      position.needsUpdate = true;
      mesh.geometry.computeVertexNormals();
    }
    return drawn;
  }

  private forces(t?: Telemetry): void {
    this.drawn.arrows = 0;
    for (const arrow of this.arrows) arrow.visible = false;
    if (!t || !this.needle.visible) return;
    t.contact_force_N.slice(0, 4).forEach((force, i) => {
      const uN = finite(force) ? 1e6 * Math.hypot(force.x, force.y, force.z) : 0;
      if (uN < 1e-3) return;
      const arrow = this.arrows[i]!;
      // The four points lie round the pipette's rim.
      const angle = (i * Math.PI) / 2;
      const rim = new THREE.Vector3(Math.cos(angle), 0, Math.sin(angle)).multiplyScalar(this.rim_um).applyQuaternion(this.needle.quaternion);
      arrow.position.copy(this.tip).add(rim);
      arrow.setDirection(direction(force));
      arrow.setLength(Math.min(uN * kArrow_um_per_uN, kLongestArrow_um), 7, 5);
      arrow.visible = true;
      this.drawn.arrows++;
    });
  }
}
