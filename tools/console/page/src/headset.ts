// The scene in a headset (WebXR): the cell as large as a head, within reach, and the state in words above it.
import * as THREE from 'three';

// Of the room for a micrometre under the microscope; where the middle of the picture is, from where the headset began.
const kRoom_m_per_um = 0.002, kBefore_m = new THREE.Vector3(0, -0.1, -0.75);
const kBoard_m = [0.9, 0.18] as const, kBoard_px = [1024, 205] as const, kWords_ms = 200;

export const hasHeadset = async (): Promise<boolean> => (await navigator.xr?.isSessionSupported('immersive-vr').catch(() => false)) ?? false;

export class Headset {
  readonly drawn = {frames: 0};
  private session?: XRSession;
  private board: THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial>;
  private words = document.createElement('canvas');
  private written = '';
  private writtenAt = 0;

  // stop: a squeeze of either hand. text: what an operator reads.
  constructor(private renderer: THREE.WebGLRenderer, private scene: THREE.Scene, private camera: THREE.PerspectiveCamera,
              private arrange: () => void, private text: () => [string, boolean], private stop: () => void, private changed: () => void) {
    [this.words.width, this.words.height] = kBoard_px;
    const material = new THREE.MeshBasicMaterial({map: new THREE.CanvasTexture(this.words), toneMapped: false});
    this.board = new THREE.Mesh(new THREE.PlaneGeometry(...kBoard_m), material);
    this.board.position.set(0, 0.5, 0).divideScalar(kRoom_m_per_um);
    this.board.scale.setScalar(1 / kRoom_m_per_um);
    this.board.visible = false;
    scene.add(this.board);
  }

  get isOn(): boolean { return this.session !== undefined; }

  // Rejects where there is none, or it is not allowed.
  async begin(): Promise<void> {
    if (this.session || !navigator.xr) return;
    const session = await navigator.xr.requestSession('immersive-vr');
    const near = this.camera.near, far = this.camera.far, pose = this.camera.matrix.clone();
    session.addEventListener('squeezestart', () => this.stop());
    session.addEventListener('end', () => {
      this.renderer.setAnimationLoop(null);
      this.renderer.xr.enabled = false;
      this.session = undefined;
      this.board.visible = false;
      this.scene.scale.setScalar(1);
      this.scene.position.set(0, 0, 0);
      Object.assign(this.camera, {near, far});
      pose.decompose(this.camera.position, this.camera.quaternion, this.camera.scale);
      this.camera.updateProjectionMatrix();
      this.changed();
    });
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType('local');
    await this.renderer.xr.setSession(session);
    this.session = session;
    this.scene.scale.setScalar(kRoom_m_per_um);
    this.scene.position.copy(kBefore_m);
    Object.assign(this.camera, {near: 0.05, far: 50});
    this.board.visible = true;
    this.renderer.setScissorTest(false);
    this.renderer.setAnimationLoop(() => this.frame());
    this.changed();
  }
  end(): void { void this.session?.end(); }

  private frame(): void {
    this.arrange();
    this.write();
    this.renderer.render(this.scene, this.camera);
    this.drawn.frames++;
  }

  private write(): void {
    const now = performance.now();
    if (now - this.writtenAt < kWords_ms) return;
    this.writtenAt = now;
    const [text, bad] = this.text();
    if (text === this.written) return;
    this.written = text;
    const c = this.words.getContext('2d')!, [wide, high] = kBoard_px;
    c.fillStyle = bad ? '#5c1a00' : '#14171a';
    c.fillRect(0, 0, wide, high);
    c.fillStyle = '#f2f4f5';
    c.textBaseline = 'top';
    text.split('\n').slice(0, 3).forEach((line, i) => {
      c.font = `${i === 0 ? 'bold ' : ''}56px system-ui, sans-serif`;
      c.fillText(line, 20, 8 + 64 * i, wide - 40);
    });
    this.board.material.map!.needsUpdate = true;
  }
}
