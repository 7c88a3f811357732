// Drives the page in a browser as an operator would: node drive.mjs BIN [SCREENSHOTS]. BIN: the folder of the built programs.
// What must hold stands in each step's name. A machine without a graphics processor draws a frame in a second or so:
// nothing here depends on how fast frames come.
import Ajv from 'ajv';
import {build} from 'esbuild';
import {chromium} from 'playwright-core';
import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createServer} from 'node:http';
import {tmpdir} from 'node:os';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = dirname(fileURLToPath(import.meta.url)), bin = resolve(process.argv[2]), pictures = process.argv[3];
const folder = mkdtempSync(join(tmpdir(), 'punctum-page-'));
const kSlow_ms = 60000;  // for what takes a fraction of a second on a machine that is free

const children = [];
function start(program, args) {
  const child = spawn(join(bin, program), args, {cwd: folder, stdio: ['ignore', 'pipe', 'pipe']});
  child.said = '';
  for (const stream of [child.stdout, child.stderr]) stream.on('data', (text) => { child.said += text; });
  child.over = new Promise((done) => child.on('exit', (code, signal) => done(code ?? signal)));
  children.push(child);
  return child;
}
async function until(what, holds) {
  for (const begun = Date.now(); ;) {
    const value = await holds();
    if (value) return value;
    if (Date.now() - begun > kSlow_ms) throw new Error(`not within ${kSlow_ms} ms: ${what}`);
    await new Promise((go) => setTimeout(go, 20));
  }
}
let browser;
async function step(name, act) {
  const begun = Date.now();
  try {
    await act();
  } catch (error) {
    console.log(`FAILED ${name}`);
    throw error;
  }
  console.log(`${((Date.now() - begun) / 1000).toFixed(1).padStart(6)} s  ${name}`);
}

async function all() {
  const run = start('punctum', ['run', 'icsi', '--set', 'vision.method=truth', '--set', 'sim.estop.relay_timeout_ms=1000', '--set',
    'sim.operator.approach_s=60', '--set', 'sim.operator.indentation_speed_um_s=0.5', '--seconds', '600', '--console', '--report', 'run', '--no-figure', '--no-frames', '--quiet']);
  const address = await until('the address is printed', () => /http:\/\/127\.0\.0\.1:(\d+)\//.exec(run.said) ?? (run.exitCode !== null ? assert.fail(run.said) : null));
  const token = await until('the token is printed', () => /#token=([0-9a-f]{64})/.exec(run.said)?.[1]);
  const url = address[0], port = address[1], station = /console of (\S+):/.exec(run.said)[1];

  browser = await chromium.launch({
    executablePath: '/usr/bin/chromium',
    args: ['--headless', '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
      '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-gpu-compositing'],
  });
  const page = await browser.newPage({viewport: {width: 640, height: 480}});
  page.setDefaultTimeout(kSlow_ms);
  // The longest time that the page stood still for.
  await page.addInitScript(() => {
    globalThis.longest_ms = 0;
    let before = performance.now();
    setInterval(() => {
      longest_ms = Math.max(longest_ms, performance.now() - before);
      before = performance.now();
    }, 50);
  });
  const errors = [];
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (line) => { if (/Content.Security.Policy|Refused to/.test(line.text())) errors.push(line.text()); });
  const text = (id) => page.locator('#' + id).innerText();
  const isStale = () => page.evaluate(() => document.body.classList.contains('stale'));
  const shoot = async (name, width, height, full = false) => {
    if (!pictures) return;
    await page.setViewportSize({width, height});
    await page.waitForTimeout(1500);
    await page.screenshot({path: join(pictures, `${name}-${width}x${height}.png`), fullPage: full});
    await page.setViewportSize({width: 640, height: 480});
  };

  await step('the page loads, and shows the running station as fresh', async () => {
    await page.goto(`${url}#token=${token}`);
    await page.waitForFunction(() => punctum.link.connected && punctum.newest?.tick > 0 && punctum.state?.core === 'ticking');
    await until('it is not grey', async () => !await isStale());
    assert.equal(await text('station'), station);
    assert.equal(await page.evaluate(() => punctum.state.role), 'operate');
    assert.ok(!page.url().includes(token), 'a link that is passed on holds no token');
    assert.match(await text('phase'), /free|contact|indentation/);
    assert.ok(await page.locator('#events li').count() > 0, 'events are listed');
  });

  await step('the scene is drawn: membranes, and more than a few colours', async () => {
    await page.waitForFunction(() => punctum.drawn.scene?.outer !== 'nothing' && punctum.drawn.scene.frames > 1);
    const drawn = await page.evaluate(() => punctum.drawn.scene);
    assert.equal(drawn.inner, 'radius');
    assert.equal(drawn.forbidden, 'floor,holder');
    assert.ok(Math.abs(drawn.coneAngle - Number(/\[cone\][^[]*alpha_rad = ([\d.]+)/.exec(readFileSync(join(folder, 'run/scene.toml'), 'utf8'))[1])) < 1e-9);
    const png = (await page.locator('#scene').screenshot()).toString('base64');
    const colours = await page.evaluate(async (data) => {
      const picture = new Image();
      picture.src = 'data:image/png;base64,' + data;
      await picture.decode();
      const canvas = new OffscreenCanvas(picture.width, picture.height), draw = canvas.getContext('2d');
      draw.drawImage(picture, 0, 0);
      const pixels = new Uint32Array(draw.getImageData(0, 0, picture.width, picture.height).data.buffer);
      return new Set(pixels).size;
    }, png);
    assert.ok(colours > 50, `${colours} colours`);
  });

  await step('keys choose views and theme, hold the plots and move their cursor; the address keeps the layout', async () => {
    await page.keyboard.press('0');
    assert.equal(await page.evaluate(() => punctum.drawn.scene.views), 4);
    assert.equal(await page.locator('[data-view="0"]').getAttribute('aria-pressed'), 'true');
    assert.match(page.url(), /view=0/);
    await page.keyboard.press('1');
    const light = await page.evaluate(() => document.documentElement.classList.contains('light'));
    await page.keyboard.press('d');
    assert.equal(await page.evaluate(() => document.documentElement.classList.contains('light')), !light);
    await page.keyboard.press('p');
    assert.equal(await page.locator('#freeze').getAttribute('aria-pressed'), 'true');
    await page.keyboard.press('p');
    await page.waitForFunction(() => punctum.drawn.plots.points > 10);
    const heights = () => page.evaluate(() => [...document.querySelectorAll('.uplot .u-wrap')].map((chart) => chart.clientHeight).join());
    const before = await heights();
    for (const key of ['s', 'e', 'c', 'e']) {
      await page.keyboard.press(key);
      await page.evaluate(() => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go))));
    }
    await until('the plots have their room again', async () => await heights() === before);
    for (let i = 0; i < 5; i++) await page.keyboard.press(',');
    await until('the cursor reads an earlier time', async () => {
      const read = await page.locator('.u-legend .u-value').first().innerText();
      return /^\d+\.\d\d$/.test(read) && Number(read) < await page.evaluate(() => punctum.newest.t_s);
    });
  });
  await step('the timing of the core is what its status says', async () => {
    await page.keyboard.press('j');
    await page.waitForFunction(() => punctum.status?.wake?.bin.length > 0 && /p99.9/.test(document.getElementById('panel-title').textContent));
    const {entries, quantiles, max} = await page.evaluate(() => {
      const h = punctum.status.wake;
      return {entries: h.bin.reduce((a, b) => a + b, h.overflow), max: h.max_us, quantiles: [0.1, 0.5, 0.999, 1].map((q) => punctum.quantile_us(h, q))};
    });
    assert.ok(entries > 100);
    assert.deepEqual([...quantiles].sort((a, b) => a - b), quantiles);
    assert.equal(quantiles[3], max);
    // Of three entries at 3, 3 and 7 us, half are below 4 and all below 8.
    assert.deepEqual(await page.evaluate(() => [0.5, 1].map((q) => punctum.quantile_us({bin: [0, 0, 0, 2, 0, 0, 0, 1], overflow: 0, max_us: 7.5}, q))), [4, 7.5]);
    await shoot('timing', 1280, 720);
    await page.keyboard.press('j');
  });
  await shoot('page', 420, 900, true);
  await shoot('page', 1280, 720);
  await shoot('page', 2560, 1440);

  await step('force is pitch; contact, puncture, an alarm, a fault and data that stop sound different', async () => {
    const heard = await page.evaluate(async () => {
      const result = {};
      for (const cue of ['contact', 'puncture', 'warning', 'alarm', 'stale']) {
        const context = new OfflineAudioContext(1, 44100, 44100);
        punctum.playCue(context, cue, 0);
        const samples = (await context.startRendering()).getChannelData(0);
        let crossings = 0, last = 0;
        samples.forEach((v, i) => {
          if (Math.abs(v) > 0.02) last = i;
          if (i > 0 && i < 2200 && (v > 0) !== (samples[i - 1] > 0)) crossings++;
        });
        result[cue] = {length_s: last / 44100, Hz: crossings / 2 / (2200 / 44100)};
      }
      return {...result, pitches: [0, 1, 2, 3, 9].map((f) => punctum.pitchOf(f))};
    });
    assert.ok(heard.contact.length_s < 0.1 && heard.puncture.length_s > 0.1 && heard.alarm.length_s > 0.5 && heard.warning.length_s < 0.35 && heard.stale.length_s > 0.5, JSON.stringify(heard));
    const Hz = ['contact', 'alarm', 'puncture', 'warning', 'stale'].map((cue) => heard[cue].Hz);
    assert.ok(Hz.every((one, i) => i === 0 || one < 0.85 * Hz[i - 1]), JSON.stringify(heard));
    assert.deepEqual([...heard.pitches].sort((a, b) => a - b), heard.pitches);
    assert.equal(heard.pitches[3], heard.pitches[4], 'no force is shriller than the highest');
    await page.keyboard.press('m');
    assert.equal(await page.evaluate(() => punctum.sound.on), true);
    await page.keyboard.press('m');
    assert.equal(await page.evaluate(() => punctum.sound.on), false);
  });

  await step('the scope shows every tick from before the trigger on, and the cursor reads it', async () => {
    await page.keyboard.press('s');
    await page.waitForFunction(() => punctum.scope.shown?.times.length > 100);
    const set = (label, value) => page.locator(`#scope [aria-label="${label}"]`).selectOption(value);
    await set('when it shows', 'normal');
    await page.locator('#scope [aria-label="level of the trigger"]:enabled').fill('0.05');
    await set('quantity of the trigger', {label: 'hand force'});
    await set('length', '0.2');
    await set('part before the trigger', '0.5');
    await set('when it shows', 'single');
    await page.locator('#scope button', {hasText: 'Again'}).click();
    await page.waitForFunction(() => punctum.scope.triggered !== undefined);
    const {shown, lost, csv} = await page.evaluate(() => ({lost: punctum.scope.lost, csv: punctum.scope.csv(),
      shown: {...punctum.scope.shown, times: [...punctum.scope.shown.times], ticks: [...punctum.scope.shown.ticks], force: [...punctum.scope.shown.columns[0]]}}));
    const at = shown.times.indexOf(shown.zero_s);
    assert.ok(shown.force[at - 1] < 0.05 && shown.force[at] >= 0.05, `${shown.force.slice(at - 2, at + 2)}`);
    assert.ok(Math.abs(shown.length_s - 0.2) < 1e-9 && Math.abs(shown.zero_s - shown.begin_s - 0.1) < 1e-9);
    assert.ok(shown.times[0] - shown.begin_s < 0.1 && shown.times.at(-1) <= shown.begin_s + 0.2 + 1e-9);
    assert.ok(shown.ticks.every((t, i) => i === 0 || t > shown.ticks[i - 1]));
    assert.equal(lost, 0);
    assert.equal(csv.trim().split('\n').length, shown.times.length + 1);
    for (let i = 0; i < 3; i++) await page.keyboard.press(',');
    assert.equal((await page.evaluate(() => punctum.scope.read())).t_s, shown.times.at(-4));
    await shoot('scope', 420, 900, true);
    await shoot('scope', 1280, 720);
    await shoot('scope', 2560, 1440);
    await page.keyboard.press('5');
    assert.ok(await page.locator('#live').isVisible() && !await page.locator('#scene').isVisible());
    await page.keyboard.press('1');
    await page.keyboard.press('e');
  });
  const row = (name) => page.locator('#parameter-list li').filter({hasText: name});
  // Control is lent for 1.5 s at a time: a page that stood still for longer has lost it, and takes it again.
  const control = async (again = true) => {
    if (await page.evaluate(() => punctum.state.control) === 'yours') return;
    if (again) assert.ok(await page.evaluate(() => longest_ms) > 1000, 'control is kept while the page is there');
    await page.click('#control');
    await page.waitForFunction(() => punctum.state.control === 'yours');
    await page.evaluate(() => { longest_ms = 0; });
  };
  const valueOf = (name) => page.evaluate((one) => punctum.parameters.find((p) => p.name === one).value, name);
  await step('parameters are dead without control, and the page says why; with control they are set within their range and taken back', async () => {
    await page.keyboard.press('c');
    const scale = row('force scale');
    await page.waitForFunction(() => punctum.parameters.length > 4 && !document.getElementById('control').disabled);
    assert.match(await text('control-note'), /Take control first/);
    assert.equal(await page.locator('#parameter-list :is(input, button):enabled').count(), 0);
    assert.match(await row('position scale').innerText(), /fixed in this scene/);
    await scale.locator('button').first().dispatchEvent('click');
    await control(false);
    const quick = {timeout: 1000};  // it is dead while control is away
    const enter = (what, holds) => until(what, async () => {
      await control();
      await scale.locator('input').fill(what, quick).then(() => scale.locator('input').press('Enter', quick)).catch(() => {});
      await page.waitForTimeout(100);
      return await holds();
    });
    await enter('1.5', async () => /Allowed: 0 to 1/.test(await scale.innerText()));
    await enter('cell', async () => /Not a number/.test(await scale.innerText()));
    await enter('0,5', async () => await valueOf('force_scale') === 0.5);
    await until('it says who and when', async () => /0\.5.*by operator at \d+\.\d s/s.test(await scale.innerText()));
    await page.waitForTimeout(2000);
    await control();
    await shoot('parameters', 420, 900, true);
    await shoot('parameters', 1280, 720);
    await shoot('parameters', 2560, 1440);
    await enter('0.25', async () => await valueOf('force_scale') === 0.25);
    // A second click before the first is answered does not go back by one more.
    for (const earlier of [0.5, 1]) {
      await until(`back to ${earlier}`, async () => {
        await control();
        await scale.getByRole('button', {name: `Back to ${earlier}`}).evaluate((back) => { back.click(); back.click(); }, undefined, quick).catch(() => {});
        return await valueOf('force_scale') === earlier;
      });
    }
    await until('there is nothing earlier', async () => !await scale.getByRole('button', {name: 'Back to'}).isEnabled());
    // A key that means something elsewhere is only text in a field.
    await until('a text is typed', async () => {
      await control();
      return await scale.locator('input').pressSequentially('m0', quick).then(() => true).catch(() => false);
    });
    assert.equal(await page.evaluate(() => punctum.sound.on), false);
    // Silent for longer than control is lent: it is lost, and does not come back by itself.
    await page.evaluate(() => { const send = WebSocket.prototype.send; WebSocket.prototype.send = () => {}; globalThis.speakAgain = () => { WebSocket.prototype.send = send; }; });
    await page.waitForFunction(() => punctum.state.control === 'free');
    await page.evaluate(() => speakAgain());
    await until('the page says that control was lost', async () => /Control was lost/.test(await text('control-note')));
    await page.waitForTimeout(1500);
    assert.equal(await page.evaluate(() => punctum.state.control), 'free');
    await control(false);
    const other = await browser.newPage();
    await other.goto(`${url}#token=${token}&panel=parameters`);
    await until('another page says who has control, and its parameters are dead', async () => {
      await control();
      return await other.evaluate(() => punctum.state?.control === "another's" && /operator .* has control/.test(document.getElementById('control-note').innerText) &&
        document.querySelectorAll('#parameters :is(input, button):enabled').length === 0);
    });
    await other.close();
    await until('control is given back', async () => {
      return await page.evaluate(() => {
        if (punctum.state.control === 'yours') document.getElementById('control').click();
        return punctum.state.control === 'free';
      });
    });
    await until('they are dead again', async () => await page.locator('#parameter-list :is(input, button):enabled').count() === 0);
    assert.equal(await valueOf('force_scale'), 1);
    await page.evaluate(() => document.activeElement?.blur());
  });

  await step('a gateway that stands still: what is shown is grey; it goes on, and it is fresh again, with a gap in the plots', async () => {
    const pid = Number(execFileSync('pgrep', ['-P', String(run.pid), 'punctum-consol']).toString());
    process.kill(pid, 'SIGSTOP');
    await until('it is grey', isStale);
    assert.match(await text('banner-title'), /No data/);
    await until('it is old', async () => Number(/([\d.]+) s old/.exec(await text('time'))?.[1]) > 3);
    process.kill(pid, 'SIGCONT');
    await until('it is fresh', async () => !await isStale());
    await page.waitForFunction(() => punctum.drawn.plots.gaps > 0);
  });

  await step('a message is as old as it took longer than the quickest; clocks that run apart are no age, a line that stays late is', async () => {
    const {text: code} = (await build({entryPoints: [join(here, 'src/delay.ts')], bundle: true, format: 'esm', write: false, logLevel: 'error'})).outputFiles[0];
    const {Delay} = await import(`data:text/javascript,${encodeURIComponent(code)}`);
    const kHour_ms = 3600e3, kEpoch_ms = 1.9e12, near = (is, should) => assert.ok(Math.abs(is - should) < 2, `${is}, ${should}`);
    for (const ppm of [-150, 0, 150]) {
      const delay = new Delay();
      let most = 0;
      for (let t = 1000; t < 5 * kHour_ms; t += 500) most = Math.max(most, delay.age_ms(kEpoch_ms + t * (1 + ppm * 1e-6), t + 20));
      assert.ok(most < 1, `${ppm} ppm: ${most} ms`);
    }
    const delay = new Delay();
    near(delay.age_ms(kEpoch_ms, 1030), 0);
    near(delay.age_ms(kEpoch_ms + 100, 1110), 0);  // quicker by 20 ms
    near(delay.age_ms(kEpoch_ms + 200, 1810), 600);
    // A line that is slower than what is told: each message later than the one before.
    let age = 0;
    for (let t = 0; t < 4000; t += 20) age = delay.age_ms(kEpoch_ms + 300 + t, 1310 + 2 * t);
    near(age, 3979);
    for (let t = 10e3; t < kHour_ms; t += 500) assert.ok(delay.age_ms(kEpoch_ms + t, 1010 + 4000 + t) > 3000, 'for an hour');
  });

  await step('what comes late over a slow line is grey, although it comes all the time; it is fresh again when the line is', async () => {
    const far = await browser.newPage();
    far.setDefaultTimeout(kSlow_ms);
    await far.addInitScript(() => {
      globalThis.late_ms = 0;
      globalThis.WebSocket = class extends WebSocket {
        set onmessage(take) { super.onmessage = (event) => (late_ms > 0 ? setTimeout(() => take(event), late_ms) : take(event)); }
      };
    });
    const isGrey = () => far.evaluate(() => document.body.classList.contains('stale'));
    await far.goto(url);
    await far.waitForFunction(() => punctum.link.connected && punctum.newest?.tick > 0);
    await until('it is fresh', async () => !await isGrey());
    const before = await far.evaluate(() => { late_ms = 3000; return punctum.newest.tick; });
    await far.waitForFunction((tick) => punctum.newest.tick > tick + 3500, before);
    for (let i = 0; i < 20; i++) {
      assert.ok(await isGrey(), 'ticks come, 3 s late');
      await far.waitForTimeout(50);
    }
    assert.ok(Number(/([\d.]+) s old/.exec(await far.locator('#time').innerText())?.[1]) > 2.5);
    await far.evaluate(() => { late_ms = 0; });
    await until('it is fresh again', async () => !await isGrey());
    // A line that is slow from the start: the first words came before anything waited.
    await far.addInitScript(() => {
      Object.defineProperty(WebSocket.prototype, 'onmessage', {set(take) {
        this.addEventListener('message', (event) => (typeof event.data === 'string' ? take(event) : setTimeout(() => take(event), 3000)));
      }});
    });
    await far.reload();
    await far.waitForFunction(() => punctum.newest?.tick > 0);
    for (let i = 0; i < 20; i++) {
      assert.ok(await isGrey(), 'ticks come, 3 s late from the first on');
      await far.waitForTimeout(50);
    }
    await far.close();
  });

  await step('a gateway that is killed: the page says so, the core goes on, and a new gateway is found', async () => {
    const before = await page.evaluate(() => punctum.newest.tick);
    process.kill(Number(execFileSync('pgrep', ['-P', String(run.pid), 'punctum-consol']).toString()), 'SIGKILL');
    await page.waitForFunction(() => !punctum.link.connected);
    assert.ok(await isStale());
    assert.match(await text('banner-title'), /No connection/);
    // Somebody else takes the port, answers, and lets nobody in.
    const tokens = [];
    const squatter = createServer((_, answer) => answer.end('<!doctype html>'));
    squatter.on('upgrade', (request, socket) => {
      tokens.push(/punctum\.token/.test(request.headers['sec-websocket-protocol']));
      socket.end('HTTP/1.1 401 Unauthorized\r\nContent-Length: 0\r\nConnection: close\r\n\r\n');
    });
    squatter.listen(Number(port), '127.0.0.1');
    await until('the page has tried again and again', () => tokens.length > 4);
    squatter.close();
    squatter.closeAllConnections();
    assert.ok(tokens.slice(1).every((shown) => !shown), `a token that was refused is not shown again: ${tokens}`);
    assert.ok(!await page.evaluate(() => Object.values(sessionStorage).some((kept) => /^[0-9a-f]{64}$/.test(kept))));
    start('punctum-console', ['--station', station, '--port', port]);
    await page.waitForFunction((ticks) => punctum.link.connected && punctum.state?.core === 'ticking' && punctum.newest?.tick > ticks, before);
    await until('it is fresh', async () => !await isStale());
    assert.equal(await page.evaluate(() => punctum.state.role), 'view', 'the token was of the gateway before');
    await until('the page says who may change parameters', async () => /token to operate/.test(await text('control-note')));
    assert.equal(await page.locator('#parameters :is(input, button):enabled').count(), 0);
    for (const button of await page.locator('#parameters button').all()) await button.dispatchEvent('click');
    assert.match(run.said, /the console was killed/);
  });

  const foreign = (await build({
    stdin: {contents: "export {FoxgloveClient} from '@foxglove/ws-protocol'", resolveDir: here},
    bundle: true, format: 'iife', globalName: 'foxglove', write: false, logLevel: 'error',
  })).outputFiles[0].text;
  // By another's client: the first message of each of these channels, which are JSON, held to the schema that came with it.
  const schemas = {};
  const conform = async (at, topics) => {
    await page.evaluate(foreign);
    const told = await page.evaluate(([address, wanted]) => new Promise((done, failed) => {
      const {FoxgloveClient} = foxglove, client = new FoxgloveClient({ws: new WebSocket(address, [FoxgloveClient.SUPPORTED_SUBPROTOCOL])});
      const of = new Map(), got = {services: []};
      client.on('error', (error) => failed(new Error(String(error.message ?? error))));
      client.on('advertiseServices', (services) => { got.services = services; });
      client.on('advertise', (channels) => channels.filter((c) => wanted.includes(c.topic)).forEach((c) => of.set(client.subscribe(c.id), c)));
      client.on('message', ({subscriptionId, data}) => {
        const {topic, encoding, schemaEncoding, schema} = of.get(subscriptionId);
        got[topic] ??= {encoding, schemaEncoding, schema, message: new TextDecoder().decode(data)};
        if (wanted.some((one) => !got[one])) return;
        client.close();
        done(got);
      });
    }), [at, topics]);
    for (const topic of topics) {
      const {encoding, schemaEncoding, schema, message} = told[topic];
      assert.deepEqual([encoding, schemaEncoding], ['json', 'jsonschema']);
      schemas[topic] = new Ajv({strict: true}).compile(JSON.parse(schema));
      assert.ok(schemas[topic](JSON.parse(message)), `${topic}: ${JSON.stringify(schemas[topic].errors)}: ${message}`);
    }
    return told;
  };
  await step('what is JSON is as its own schema says, which a validator that is not ours compiles; services tell theirs', async () => {
    const told = await conform(`ws://127.0.0.1:${port}/`, ['/punctum/state', '/punctum/parameters', '/punctum/fixtures']);
    const fits = schemas['/punctum/state'], state = JSON.parse(told['/punctum/state'].message);
    for (const key of Object.keys(state)) assert.ok(!fits({...state, [key]: undefined}), `${key} may be missing`);
    assert.ok(!fits({...state, more: 1}));
    assert.ok(JSON.parse(told['/punctum/parameters'].message).parameters.length > 4 && JSON.parse(told['/punctum/fixtures'].message).cone);
    const requests = Object.fromEntries(told.services.map((s) => [s.name, new Ajv({strict: true}).compile(JSON.parse(s.request.schema))]));
    assert.deepEqual(Object.keys(requests).sort(), ['control', 'hand', 'replay', 'set', 'stop'].map((name) => `/punctum/${name}`));
    assert.ok(requests['/punctum/set']({name: 'force_scale', value: 1}) && !requests['/punctum/set']({value: 1}));
    assert.ok(requests['/punctum/hand']({moved_m: [0, 0, 0], hold: true}) && !requests['/punctum/hand']({moved_m: [0, 0]}));
  });
  await step("Foxglove's own client reads the channels, and protoc the messages by the schema that came with them", async () => {
    await page.evaluate(foreign);
    const got = await page.evaluate(async (at) => {
      const {FoxgloveClient} = foxglove;
      const client = new FoxgloveClient({ws: new WebSocket(at, [FoxgloveClient.SUPPORTED_SUBPROTOCOL])});
      return await new Promise((done, failed) => {
        client.on('error', (error) => failed(new Error(String(error.message ?? error))));
        client.on('advertise', (channels) => {
          const one = channels.find((c) => c.topic === '/punctum/telemetry');
          client.subscribe(one.id);
          client.on('message', (message) => {
            client.close();
            done({channel: one, topics: channels.map((c) => c.topic), time: Number(message.timestamp),
              bytes: Array.from(new Uint8Array(message.data.buffer, message.data.byteOffset, message.data.byteLength))});
          });
        });
      });
    }, `ws://127.0.0.1:${port}/`);
    assert.deepEqual(got.topics, ['telemetry', 'observation', 'surface', 'event', 'status', 'state', 'parameters', 'ticks', 'picture', 'replay', 'fixtures'].map((name) => `/punctum/${name}`));
    assert.ok(Math.abs(got.time / 1e6 - Date.now()) < kSlow_ms);
    writeFileSync(join(folder, 'schema'), Buffer.from(got.channel.schema, 'base64'));
    const read = execFileSync('protoc', ['--descriptor_set_in', join(folder, 'schema'), '--decode', got.channel.schemaName],
      {input: Buffer.from(got.bytes)}).toString();
    assert.match(read, /^tick: \d+/m);
    assert.match(read, /^tip_m \{\n  x: /m);
    assert.equal((read.match(/^effect_N: /gm) ?? []).length, 8);
  });

  await step('a page of another site, in the same browser, is not let in', async () => {
    const other = createServer((_, answer) => answer.end('<!doctype html>')).listen(0, '127.0.0.1');
    await new Promise((go) => other.once('listening', go));
    const stranger = await browser.newPage();
    await stranger.goto(`http://127.0.0.1:${other.address().port}/`);
    const end = await stranger.evaluate((at) => new Promise((done) => {
      const socket = new WebSocket(at, ['foxglove.websocket.v1']);
      socket.onopen = () => done('opened');
      socket.onclose = () => done('refused');
    }), `ws://127.0.0.1:${port}/`);
    assert.equal(end, 'refused');
    await stranger.close();
    other.close();
  });

  await step('one click stops the station, and the page says what stopped it and what clears it', async () => {
    await page.click('#stop');
    await page.waitForFunction(() => punctum.state?.fault?.name === 'command_stop');
    await until('the banner says so', async () => /STOP.*command stop/.test(await text('banner-title')));
    assert.match(await text('banner-clears'), /It clears: not in this run/);
    assert.ok(schemas['/punctum/state'](await page.evaluate(() => punctum.state)), JSON.stringify(schemas['/punctum/state'].errors));
    await shoot('stopped', 1280, 720);
    await run.over;
    const report = JSON.parse(readFileSync(join(folder, 'run/report.json'), 'utf8'));
    // Everything else that was clicked left no command.
    const commands = report.events.filter((e) => /^command/.test(e.event) && e.writer === 'console');
    assert.deepEqual(commands.map((e) => e.what).filter((what, i, all) => what !== all[i - 1]), ['force_scale', 'stop']);
    assert.equal(report.faults[0].name ?? report.faults[0].fault ?? report.faults[0], 'command_stop');
  });

  await step('a recording is played: its picture with what was found, its marks, any moment; a link restores the moment', async () => {
    // In virtual time vision is never late, however busy the machine is.
    const seen = start('punctum', ['run', 'icsi', '--clock', 'virtual', '--seconds', '7', '--quiet', '--no-frames', '--no-figure', '--record', '--pictures', '--report', 'seen']);
    assert.equal(await seen.over, 1, seen.said);  // the time limit
    const replay = start('punctum-replay', ['seen/recording.mcap', '--console']);
    replay.stdin?.end();
    const link = await until('the address is printed', () => /http:\S+/.exec(replay.said)?.[0]);
    await page.goto('about:blank');  // the address before differs in its last part alone
    await page.goto(link);
    await page.waitForFunction(() => punctum.replay?.playing && punctum.newest?.tick > 0);
    await conform(`ws://127.0.0.1:${/:(\d+)\//.exec(link)[1]}/`, ['/punctum/replay', '/punctum/state']);
    await page.keyboard.press('5');
    await page.waitForFunction(() => punctum.drawn.live.found);
    const pressed = async (key, holds, value) => {
      await page.keyboard.press(key);
      await page.waitForFunction(holds, value);
    };
    await pressed(' ', () => !punctum.replay.playing);
    await page.locator('#replay input').fill('0');
    await page.waitForFunction(() => punctum.replay.now_s === 0);
    await page.evaluate(() => document.activeElement.blur());
    for (let at = 0, phase = 0; phase !== 1; [at, phase] = await page.evaluate(() => [punctum.replay.now_s, punctum.newest.phase])) {
      await pressed('n', (before) => punctum.replay.now_s > before && Math.abs(punctum.newest.t_s - punctum.replay.now_s) < 0.01, at);  // other marks may come before the contact
    }
    await page.waitForFunction(() => punctum.drawn.plots.gaps > 0);
    const contact = await page.evaluate(() => punctum.replay.now_s);
    await page.waitForTimeout(1500);
    assert.equal(await page.evaluate(() => punctum.replay.now_s), contact, 'it stands still');
    assert.ok(!await isStale(), 'what stands still is not old');
    assert.match(page.url(), new RegExp(`t=${contact.toFixed(3)}`));
    await page.keyboard.press('Escape');
    assert.ok(!await page.locator('#stop').isEnabled() && !await page.locator('#banner').isVisible());
    assert.match(await text('stop-why'), /nothing to stop/);
    await shoot('replay', 420, 900, true);
    await shoot('replay', 1280, 720);
    await shoot('replay', 2560, 1440);
    await page.selectOption('#replay select', '2');
    await page.waitForFunction(() => punctum.replay.speed === 2);
    await pressed('s', () => punctum.scope.lost === 0);
    await pressed(' ', () => punctum.replay.playing);
    await page.waitForFunction((from) => punctum.replay.now_s > from + 1.2, contact);
    await pressed(' ', () => !punctum.replay.playing);
    await page.waitForFunction(() => punctum.scope.shown?.times.length > 500);
    // What the scope shows is what another program reads in the same file.
    execFileSync(join(bin, 'punctum-export'), ['seen/recording.mcap', '--csv', 'tables'], {cwd: folder, stdio: 'ignore'});
    const table = (text) => text.trim().split('\n').map((line) => line.split(','));
    const [head, ...rows] = table(readFileSync(join(folder, 'tables/samples.csv'), 'utf8'));
    const at = (t_s) => Number(t_s).toFixed(4);
    const depth = new Map(rows.map((r) => [at(r[head.indexOf('t_s')]), 1e6 * Number(r[head.indexOf('wd_m')])]));
    const [names, ...shown] = table(await page.evaluate(() => punctum.scope.csv()));
    const column = names.findIndex((name) => name.startsWith('depth'));
    let compared = 0;
    for (const r of shown) {
      if (!depth.has(at(r[1]))) continue;
      compared++;
      assert.ok(Math.abs(Number(r[column]) - depth.get(at(r[1]))) < 1e-3, `${r[1]} s: ${r[column]}, ${depth.get(at(r[1]))}`);
    }
    assert.ok(compared > 400, `${compared} of ${shown.length}`);
    // Armed, it catches its trigger while another panel is shown; a link has the set-up.
    const set = (label, value) => page.locator(`#scope [aria-label="${label}"]`).selectOption(value);
    await set('when it shows', 'single');
    await set('quantity of the trigger', {label: 'phase'});
    await set('edge of the trigger', 'changes');
    await page.keyboard.press('e');
    await page.locator('#replay input').fill('0');
    await page.waitForFunction(() => punctum.replay.now_s === 0);
    await page.evaluate(() => document.activeElement.blur());
    await pressed(' ', (at) => Math.abs(punctum.scope.triggered - at) < 0.01, contact);
    await until('the page says so', async () => /caught/.test(await text('show-scope')));
    await page.waitForFunction(() => /trigger=single_phase_changes/.test(location.hash));
    // By somebody who has no token.
    const other = await (await browser.newContext({viewport: {width: 640, height: 480}})).newPage();
    other.setDefaultTimeout(kSlow_ms);
    await other.goto(link.replace(/#.*/, `#t=${contact.toFixed(3)}&view=5&panel=events`));
    await other.waitForFunction((at) => punctum.replay && !punctum.replay.playing && Math.abs(punctum.replay.now_s - at) < 0.01, contact);
    assert.equal(await other.evaluate(() => punctum.state.role), 'view');
    assert.ok(await other.locator('#live').isVisible());
    await other.context().close();
    replay.kill('SIGINT');
    await replay.over;
  });

  await step('a click into the picture chooses how deep the needle may go; it is dead, and says why, until control is taken', async () => {
    const seen = start('punctum', ['run', 'icsi', '--set', 'sim.estop.relay_timeout_ms=1000', '--set', 'sim.operator.approach_s=60', '--seconds', '600', '--console',
      '--report', 'target', '--no-figure', '--no-frames', '--quiet']);
    const link = await until('the address is printed', () => /http:\S+/.exec(seen.said)?.[0]);
    await page.goto('about:blank');
    await page.goto(`${link}&view=1&panel=events`);
    await page.waitForFunction(() => punctum.drawn.scene?.outer === 'surface' && punctum.drawn.scene.inner === 'surface');
    await page.keyboard.press('5');
    await page.waitForFunction(() => punctum.drawn.live.tip && punctum.parameters.length > 4);
    const note = () => text('target-note');
    // So deep past the membrane, which is the gap that vision measured ahead of the tip; without a depth the tip itself. The gap.
    // Again where the picture that was clicked is one that vision found no needle in, or has not looked at.
    const at = (depth_um) => until('a picture with a needle in it is clicked', async () => {
      const seen = await page.evaluate(() => punctum.drawn.live.tip && [...punctum.drawn.live.tip, punctum.drawn.live.pixel, 1e6 * punctum.newest.obs_gap_m]);
      if (!seen) return;
      const [x, y, scale, gap_um] = seen;
      await page.locator('#live').click({position: {x: depth_um === undefined ? x : x - 1e-6 * (gap_um + depth_um) * scale, y}, timeout: 3000});
      return !/^No depth is known/.test(await note()) && gap_um;
    });
    await at(30);
    assert.match(await note(), /Take control first/);
    assert.ok(!await page.locator('#target-set').isVisible());
    await page.locator('#target-set').dispatchEvent('click');
    await page.keyboard.press('c');
    await page.click('#control');
    await page.waitForFunction(() => punctum.state.control === 'yours');
    await until('the page knows it', async () => /You have control/.test(await text('control-note')));
    const gap_um = await at();
    const said = /^(-?[\d.]+) µm past the membrane. Allowed: more than 0 to [\d.]+ µm/.exec(await note());
    assert.ok(said, await note());
    assert.ok(gap_um > 20 && Math.abs(Number(said[1]) + gap_um) < 3, `${said[1]} where the gap is ${gap_um}`);
    await page.locator('#target-set').dispatchEvent('click');
    let chosen;
    const choose = (depth_um) => until('a place is chosen', async () => {
      // A large screenshot takes so long that control is lost.
      if (await page.evaluate(() => punctum.state.control === 'free')) await page.click('#control');
      await at(depth_um).catch(() => {});  // just drawn anew, in another size
      return chosen = await page.evaluate(() => punctum.target.chosen_um);
    });
    await choose(30);
    assert.ok(Math.abs(chosen - 30) < 4, `${chosen}`);
    await shoot('target', 420, 900, true);
    await shoot('target', 1280, 720);
    await shoot('target', 2560, 1440);
    await until('the limit is the chosen one', async () => {
      await choose(30);
      await page.locator('#target-set').dispatchEvent('click');
      await page.waitForTimeout(300);
      return Math.abs(await valueOf('depth_limit') - chosen) < 1e-6;
    });
    // Chosen, but control is given back before it is asked for.
    await choose(20);
    await page.click('#control');
    await until('it is dead again', async () => await page.evaluate(() => punctum.target.chosen_um === undefined) && /Take control first/.test(await note()));
    await page.locator('#target-set').dispatchEvent('click');
    await page.evaluate(() => document.activeElement.blur());
    await page.keyboard.press('Escape');
    await seen.over;
    const report = JSON.parse(readFileSync(join(folder, 'target/report.json'), 'utf8'));
    assert.deepEqual(report.events.filter((e) => /^command/.test(e.event) && e.writer === 'console').map((e) => e.what).filter((what, i, all) => what !== all[i - 1]), ['depth_limit', 'stop']);
  });

  // Somebody who does what the page says, until `over`.
  const follow = async (over) => {
    const pressed = new Set();
    let way = '';
    const hold = async (button, on) => {
      if (on === pressed.has(button)) return;
      if (on) pressed.add(button); else pressed.delete(button);
      await page.mouse[on ? 'down' : 'up']({button});
    };
    const go = async (key) => {
      if (key === way) return;
      if (way) await page.keyboard.up(way);
      if (key) await page.keyboard.down(key);
      way = key;
    };
    let asked = '';
    await until('it is over', async () => {
      const next = asked = await text('hand-step');
      if (/^Take the hand/.test(next)) {  // a page that stands still for longer than it is lent loses it
        await go('');
        await hold('left', false);
        await hold('right', false);
        await page.keyboard.press('h');
        await page.waitForTimeout(300);
      } else if (/press it anew/i.test(next) || /press it again\.$/.test(next) && /left button/.test(next)) {
        await go('');
        await hold('left', false);
        await page.waitForTimeout(700);
        await hold('left', true);
        await page.waitForTimeout(300);
      } else if (/^Hold the left/.test(next)) {
        await go('');
        await hold('left', true);
      } else if (/^Not yet/.test(next)) {
        await page.waitForTimeout(300);  // nobody is quicker, and it may have begun meanwhile
        if (/^Not yet/.test(await text('hand-step'))) {
          await hold('right', false);
          await go('ArrowLeft');
          await page.waitForTimeout(200);
        }
      } else if (/^Let inject go/.test(next)) {
        await hold('right', false);
        await page.waitForTimeout(300);
        await hold('right', true);
        await page.waitForTimeout(300);
      } else if (/^Move left|^Push on/.test(next)) await go('ArrowLeft');
      else if (/inject/.test(next)) {
        await go('');
        await hold('right', true);
      } else if (/^Draw back/.test(next)) {
        await hold('right', false);
        await go('ArrowRight');
      }
      return await over();
    }).catch((error) => { throw new Error(`${error.message}; the page asks for: ${asked}`); });
    await go('');
    for (const button of [...pressed]) await hold(button, false);
  };
  const ownHand = async (report, page) => {
    const own = start('punctum', ['run', 'own-hand', '--report', report, '--no-figure', '--no-frames', '--quiet', '--set', 'sim.estop.relay_timeout_ms=1000']);
    const link = await until('the address is printed', () => /http:\S+/.exec(own.said)?.[0]);
    await page.goto('about:blank');
    await page.goto(link);
    await page.waitForFunction(() => punctum.newest?.tick > 0 && punctum.state?.hand_here);
    const box = await page.locator('#picture').boundingBox();
    await page.locator('#take-hand').click();
    await page.waitForFunction(() => punctum.hand.taken);
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    return own;
  };
  await step('without pointer lock, too, a button counts only while it is pressed: released anywhere, and not after the page lost the focus', async () => {
    const other = await browser.newPage({viewport: {width: 1000, height: 700}});
    other.setDefaultTimeout(kSlow_ms);
    await other.addInitScript(() => {
      Element.prototype.requestPointerLock = () => { throw new Error('not allowed'); };
      globalThis.pad = {mapping: 'standard', axes: [0, 0, 0, 0], buttons: Array.from({length: 16}, () => ({pressed: false}))};
      navigator.getGamepads = () => [globalThis.pad];
    });
    const own = await ownHand('released', other);
    const kInject = 2, kHold = 8;
    // What the page holds pressed: the station takes a hold back where the page was silent, which a slow machine's is.
    const held = () => other.evaluate(() => [...new Set(punctum.hand.pressed.values())].reduce((bits, one) => bits | {inject: 2, hold: 8}[one], 0));
    const told = (what, bits) => until(`${what}: ${bits}`, async () => await held() === bits);
    const stays = async (what, bits) => {
      await other.waitForTimeout(400);
      assert.equal(await held(), bits, what);
    };
    const box = await other.locator('#picture').boundingBox(), middle = [box.x + box.width / 2, box.y + box.height / 2];
    await other.mouse.down({button: 'left'});
    await told('the left button', kHold);
    await other.mouse.down({button: 'right'});
    await told('the right one with it', kHold | kInject);
    await other.mouse.move(box.x + box.width / 2, 5);
    await other.mouse.up({button: 'right'});
    await told('the right one released outside', kHold);
    await other.mouse.up({button: 'left'});
    await told('the left one released outside', 0);
    await other.mouse.move(...middle);
    await stays('back in the picture', 0);
    await other.keyboard.down(' ');
    await told('a key', kHold);
    await other.evaluate(() => dispatchEvent(new Event('blur')));
    await told('the page is not in focus', 0);
    await other.keyboard.down(' ');  // it is down already: its repeat
    await stays("a key's repeat", 0);
    await other.keyboard.up(' ');
    await other.keyboard.down(' ');
    await told('pressed anew', kHold);
    await other.keyboard.up(' ');
    await told('released', 0);
    const pad = (pressed) => other.evaluate((is) => { globalThis.pad.buttons[5].pressed = is; }, pressed);
    await pad(true);
    await told('of a gamepad', kHold);
    await other.evaluate(() => dispatchEvent(new Event('blur')));
    await told('the page is not in focus', 0);
    await stays('a gamepad that goes on', 0);
    await pad(false);
    await other.waitForTimeout(200);
    await pad(true);
    await told('pressed anew', kHold);
    own.kill('SIGINT');
    await own.over;
    await other.close();
  });

  await step('a press of inject that opened nothing is to be let go; what was kept back, or given, is not asked for like a first press', async () => {
    const {text: code} = (await build({entryPoints: [join(here, 'src/hand.ts')], bundle: true, format: 'esm', write: false, logLevel: 'error'})).outputFiles[0];
    const {nextStep} = await import(`data:text/javascript,${encodeURIComponent(code)}`);
    const kRefused = 1 << 14;
    const says = (alarms, injects, opened) => nextStep({stop: 0, alarms, phase: 4, injector_open: false}, true, true, injects, opened);
    assert.match(says(0, false, false), /^Press inject/);
    assert.match(says(0, true, false), /^Let inject go and press it again/);
    assert.match(says(kRefused, true, false), /^Not yet/);
    assert.match(says(0, true, true), /^Draw back/);
  });
  await step("a hand of one's own, by what the page says, injects a cell", async () => {
    const own = await ownHand('own', page);
    assert.equal(await page.evaluate(() => punctum.state.control), 'yours');
    let shot = false;
    await follow(async () => {
      if (!shot && await page.evaluate(() => punctum.newest.phase === 2)) {
        shot = true;
        await page.screenshot(pictures ? {path: join(pictures, 'hand.png')} : {});
      }
      return own.exitCode !== null;
    });
    await own.over;
    const report = JSON.parse(readFileSync(join(folder, 'own/report.json'), 'utf8'));
    // What was asked for while the injector might not open yet counts as asked, and late vision shuts it: the dose may fall short of that.
    assert.equal(report.cells.done + report.cells.injected_in_part, 1, own.said);
    assert.equal(report.cells.lost, 0);
    assert.ok(Number(/dose +([\d.]+) s/.exec(own.said)[1]) >= 0.1, own.said);
  });
  await step('whoever loses the connection while pushing has let go: the station stops by itself, and does not go on by itself', async () => {
    const own = await ownHand('cut', page);
    await follow(() => page.evaluate(() => punctum.newest.phase === 2));
    await page.mouse.down({button: 'left'});
    await page.waitForFunction(() => punctum.newest.buttons & 8);
    process.kill(Number(execFileSync('pgrep', ['-P', String(own.pid), 'punctum-consol']).toString()), 'SIGKILL');
    await until('it has stopped', () => /FAULT enabling_released/.test(own.said));
    await page.waitForFunction(() => !punctum.hand.taken || !punctum.link.connected);
    own.kill('SIGINT');
    await own.over;
    const report = JSON.parse(readFileSync(join(folder, 'cut/report.json'), 'utf8'));
    assert.ok(report.faults.some((f) => f.name === 'enabling_released'), JSON.stringify(report.faults));
  });

  await step('a headset shows the scene to both eyes, and a squeeze of the hand stops the station', async () => {
    const worn = start('punctum', ['run', 'icsi', '--set', 'vision.method=truth', '--set', 'sim.estop.relay_timeout_ms=1000', '--set', 'sim.operator.approach_s=60',
      '--seconds', '600', '--console', '--report', 'worn', '--no-figure', '--no-frames', '--quiet']);
    const link = await until('the address is printed', () => /http:\S+/.exec(worn.said)?.[0]);
    await page.goto('about:blank');
    await page.goto(link);
    await page.waitForFunction(() => punctum.newest?.tick > 0);
    assert.ok(!await page.locator('#headset').isVisible(), 'this browser has none');
    await page.goto('about:blank');
    await page.addInitScript({content: `${readFileSync(join(here, 'node_modules/iwer/build/iwer.min.js'), 'utf8')}
      globalThis.emulated = new IWER.XRDevice(IWER.metaQuest3); emulated.installRuntime({forceInstall: true}); emulated.stereoEnabled = true;`});
    await page.goto(link);
    await page.locator('#headset').click();
    await page.waitForFunction(() => punctum.headset.isOn && punctum.headset.drawn.frames > 3 && punctum.drawn.scene.outer !== 'nothing');
    const eyes = await page.evaluate(async () => {
      await new Promise((go) => setTimeout(go, 1500));
      const canvas = document.getElementById('scene'), copy = new OffscreenCanvas(canvas.width, canvas.height), draw = copy.getContext('2d');
      await new Promise((go) => requestAnimationFrame(go));
      draw.drawImage(canvas, 0, 0);
      const blob = await copy.convertToBlob(), half = Math.floor(canvas.width / 2);
      const [left, right] = [0, half].map((x) => new Uint32Array(draw.getImageData(x, 0, half, canvas.height).data.buffer));
      return {colours: [left, right].map((eye) => new Set(eye).size), apart: left.filter((v, i) => v !== right[i]).length / left.length,
        png: [...new Uint8Array(await blob.arrayBuffer())]};
    });
    assert.ok(eyes.colours.every((n) => n > 50), `${eyes.colours} colours`);
    assert.ok(eyes.apart > 0.01, `both eyes see the same but for ${eyes.apart}`);
    if (pictures) {
      writeFileSync(join(pictures, 'headset-eyes.png'), Buffer.from(eyes.png));
      await page.screenshot({path: join(pictures, 'headset.png')});
    }
    assert.ok(!await page.evaluate(() => punctum.state.fault), 'nothing stopped yet');
    await page.evaluate(() => emulated.controllers.right.updateButtonValue('squeeze', 1));
    await page.waitForFunction(() => punctum.state?.fault?.name === 'command_stop');
    await page.evaluate(() => punctum.headset.end());
    await page.waitForFunction(() => !punctum.headset.isOn);
    await worn.over;
  });

  await step('nothing went wrong inside the page, and its rules of origin were not broken', async () => assert.deepEqual(errors, []));
}

let failed = false;
try {
  await all();
} catch (error) {
  failed = true;
  console.log(error.stack ?? String(error));
  for (const child of children) console.log(child.said.split('\n').slice(-8).join('\n'));
}
await browser?.close();
for (const child of children) child.kill('SIGKILL');
if (!failed) rmSync(folder, {recursive: true});
process.exit(failed ? 1 : 0);
