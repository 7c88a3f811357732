// read.mjs RECORDING FOLDER: what @mcap/core makes of a recording: by its index where it has one, and record by record, with every
// checksum. Prints TOPIC COUNT lines; writes the schema of /telemetry and its last message into FOLDER.
import { readFileSync, writeFileSync } from "node:fs";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";

const [recording, folder] = process.argv.slice(2);
const bytes = readFileSync(recording);

const counts = new Map();
const channels = new Map();
const schemas = new Map();
let last;
const stream = new McapStreamReader({ validateCrcs: true });
stream.append(bytes);
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") channels.set(record.id, record);
  if (record.type === "Message") {
    const channel = channels.get(record.channelId);
    counts.set(channel.topic, (counts.get(channel.topic) ?? 0) + 1);
    if (channel.topic === "/telemetry") last = { record, channel };
  }
}
console.log(`finished ${stream.done()}`);
for (const [topic, count] of [...counts].sort()) console.log(`${topic} ${count}`);
if (last.channel.messageEncoding !== "protobuf") throw new Error(last.channel.messageEncoding);
const schema = schemas.get(last.channel.schemaId);
if (schema.name !== "punctum.v1.Telemetry" || schema.encoding !== "protobuf") throw new Error(schema.name);
writeFileSync(`${folder}/schema`, schema.data);
writeFileSync(`${folder}/message`, last.record.data);

if (stream.done()) {
  const reader = await McapIndexedReader.Initialize({
    readable: {
      size: async () => BigInt(bytes.length),
      read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
    },
  });
  let indexed = 0;
  let before = 0n;
  for await (const message of reader.readMessages()) {
    if (message.logTime < before) throw new Error("time goes back");
    before = message.logTime;
    ++indexed;
  }
  if (BigInt(indexed) !== reader.statistics.messageCount) throw new Error(`${indexed} messages by the index`);
  // The middle of the recording by its index, as whoever seeks.
  const { messageStartTime: begin, messageEndTime: end } = reader.statistics;
  const middle = begin + (end - begin) / 2n;
  const found = await reader.readMessages({ topics: ["/telemetry"], startTime: middle, endTime: middle + 2_000_000n });
  let near = 0;
  for await (const message of found) near += message.logTime >= middle ? 1 : 0;
  if (near < 2 || near > 3) throw new Error(`${near} ticks within 2 ms`);
}
