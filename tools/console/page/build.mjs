// Builds the page into built/: index.html, page.js, page.css. The same sources and the same lock file give the same bytes.
// node build.mjs [FOLDER]
import {build} from 'esbuild';
import {copyFileSync, mkdirSync, readFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, 'built');

// The messages of tools/wire/station.proto: {Message: {number: [name, type, repeated]}}, enums as types.
// It knows what that file uses: messages, enums, oneof, repeated, scalars.
export function tables(proto) {
  const words = proto.replace(/\/\/.*$/gm, '').match(/[A-Za-z_][\w.]*|\d+|"[^"]*"|[{}=;]/g);
  const messages = {}, enums = {};
  let at = 0;
  const expect = (word) => {
    if (words[at++] !== word) throw new Error(`station.proto: ${word} expected before ${words.slice(at - 1, at + 5).join(' ')}`);
  };
  const readEnum = (outer) => {
    const name = outer + words[at++], values = {};
    expect('{');
    while (words[at] !== '}') {
      const value = words[at++];
      expect('=');
      values[Number(words[at++])] = value;
      expect(';');
    }
    expect('}');
    enums[name] = values;
  };
  const readMessage = (outer) => {
    const name = outer + words[at++], fields = messages[name] = {};
    expect('{');
    let depth = 1;
    while (depth > 0) {
      const word = words[at++];
      if (word === 'message') readMessage(name + '.');
      else if (word === 'enum') readEnum(name + '.');
      else if (word === 'oneof') {
        at++;
        expect('{');
        depth++;
      } else if (word === '}') depth--;
      else {
        const repeated = word === 'repeated', type = repeated ? words[at++] : word, field = words[at++];
        expect('=');
        fields[Number(words[at++])] = [field, type, repeated];
        expect(';');
      }
    }
  };
  while (at < words.length) {
    const word = words[at++];
    if (word === 'message') readMessage('');
    else if (word === 'enum') readEnum('');
    else while (words[at++] !== ';');
  }
  // Names as they are found from inside a message.
  for (const [name, fields] of Object.entries(messages)) {
    for (const field of Object.values(fields)) {
      const inner = `${name}.${field[1]}`;
      if (messages[inner] || enums[inner]) field[1] = inner;
    }
  }
  return {messages, enums};
}

const schema = {
  name: 'wire-schema',
  setup(b) {
    b.onResolve({filter: /^wire-schema$/}, () => ({path: 'wire-schema', namespace: 'wire'}));
    b.onLoad({filter: /.*/, namespace: 'wire'}, () => ({
      contents: JSON.stringify(tables(readFileSync(join(here, '../../wire/station.proto'), 'utf8'))),
      loader: 'json',
    }));
  },
};

mkdirSync(out, {recursive: true});
await build({
  absWorkingDir: here,
  entryPoints: {page: 'src/main.ts'},
  outdir: out,
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  charset: 'utf8',
  legalComments: 'eof',
  plugins: [schema],
});
copyFileSync(join(here, 'src/index.html'), join(out, 'index.html'));
