// node check.mjs REQUESTS.json SESSION.txt [ADDR:PORT TOKEN]: a client that has nothing but proto/WIRE.md reads the
// recorded session, says its messages again byte for byte, and asks a running wall.
import assert from 'node:assert';
import fs from 'node:fs';

import {Link, decodeBody, decodeMessage, encodeMessage, framed, unframed} from './wire.mjs';
import {xxh3} from './xxh3.mjs';

const [requests, session, address, access] = process.argv.slice(2);
const described = JSON.parse(fs.readFileSync(requests));

assert.equal(xxh3(Buffer.alloc(0)), 0x2d06800538d394c2n);
let read = 0;
for (const line of fs.readFileSync(session, 'utf8').split('\n')) {
    const found = /^\d([<>]) (\w+) ([0-9a-f]+)$/.exec(line);
    if (!found) continue;
    const [, way, name, hex] = found, {number, epoch, payload} = unframed(Buffer.from(hex, 'hex'));
    const message = described.wire.messages.find(each => each.number === number);
    assert.equal(message.name, name);
    const said = decodeMessage(message.fields, payload);
    if (way === '>') assert.equal(framed(number, epoch, encodeMessage(message.fields, said)).toString('hex'), hex);
    if (name === 'Request') decodeBody(described.requests, said.body);
    if (name === 'Reply' && !said.error) decodeBody(described.answers, said.body);
    if (name === 'Notice') assert.equal(decodeBody(described.notices, said.body).name, 'Frame');
    ++read;
}
assert.ok(read > 20);
console.log(`read ${read} messages`);

if (address) {
    await assert.rejects(Link.connect(address, described, 'a stranger'), /its own user/);
    const link = await Link.connect(address, described, 'in JavaScript', access);
    const status = await link.ask('GetStatus');
    assert.equal(status.name, 'Status');
    const objects = await link.ask('GetObjects', {names: ['/thing'], paths: true});
    const [records, texts] = objects.parts;
    assert.equal(texts.toString(), '/thing');
    const node = records.readBigUInt64LE();
    const moved = await link.ask('MoveNode', {node, translation: [4, 5, 6]});
    assert.equal(moved.name, 'Committed');
    await assert.rejects(link.ask('RemoveNode', {node: 1}),
        error => error.code === 'refused' && /root/.test(error.message));
    const frame = new Promise(resolve => { link.notice = resolve; });
    await link.ask('SubscribeNews', {frames: 1});
    const told = await frame;
    assert.equal(told.name, 'Frame');
    const deed = `moved #${node} of ${status.members.wall_name}`;
    console.log(`${deed}; frame ${told.members.frame} was shown by ${told.members.shown}`);
    link.close();
}
