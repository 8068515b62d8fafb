// Reads every object of a drive that its EDS names, with the npm package `canopen` as SDO client.
// Usage: node walk_dictionary.js FOLDER_OF_node_modules EDS NODE_ID
// Frames pass as lines `ID DATA` in hexadecimal, from the bus on standard input and to it on standard output; the last
// line is `found` and what each object held, as JSON.
'use strict';
const Module = require('module');
const path = require('path');
const readline = require('readline');

// A compiled checksum for block transfers, which are not used here.
const load = Module._load;
Module._load = (name, ...rest) => (name === 'node-crc' ? {} : load(name, ...rest));

const [folder, edsPath, nodeId] = process.argv.slice(2);
const { AccessType, Device, Eds } = require(path.join(folder, 'canopen'));
const server = Number(nodeId);

const client = new Device({ id: 0x7e, eds: new Eds() });
client.eds.addSdoClientParameter(server, 0x600 | server, 0x580 | server);
client.on('message', ({ id, data }) => console.log(`${id.toString(16)} ${data.toString('hex')}`));
client.start();
const lines = readline.createInterface({ input: process.stdin });
lines.on('line', (line) => {
  const [id, data] = line.split(' ');
  client.receive({ id: parseInt(id, 16), data: Buffer.from(data || '', 'hex') });
});

async function main() {
  const found = [];
  for (const entry of Eds.fromFile(edsPath).values()) {
    const places = [...Array(255).keys()].filter((subIndex) => entry[subIndex]);
    for (const place of places.length ? places : [0]) {
      const part = entry[place] || entry; // its own subIndex is wrong beyond 9 in version 6.2.1
      if (part.accessType === AccessType.WRITE_ONLY) continue;
      const at = { index: entry.index, subIndex: place };
      const read = { deviceId: server, dataType: part.dataType, timeout: 5000, ...at };
      try {
        found.push({ ...at, name: part.parameterName, value: await client.sdo.upload(read) });
      } catch (error) {
        found.push({ ...at, name: part.parameterName, error: String(error) });
      }
    }
  }
  const plain = (_, value) => (typeof value === 'bigint' ? Number(value) : value);
  console.log(`found ${JSON.stringify(found, plain)}`);
  process.exit(0);
}

main();
