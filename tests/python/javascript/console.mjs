// node console.mjs LINK: a program in JavaScript that has nothing but the link of a console: it reads what can be said,
// moves /thing, makes a triangle of arrays, and is told of all that.
import assert from 'node:assert';
import http from 'node:http';

import {Socket} from './socket.mjs';

const link = process.argv[2], url = new URL(link), authorization = `Bearer ${url.searchParams.get('token')}`;

const from = path => ({host: url.hostname, port: url.port, path, headers: {authorization}});
const get = path => new Promise((resolve, reject) => http.get(from(path), response => {
    let text = '';
    response.on('data', data => text += data);
    response.on('end', () => resolve({status: response.statusCode, text}));
}).on('error', reject));

const api = JSON.parse((await get('/api')).text);
assert.equal(api.api, 1);

// What looks and asks alone: each is answered as it says, or refused with a code of the list.
const socket = await Socket.connect(link);
let asked = 0;
for (const request of api.requests.filter(each => each.role === 'viewer')) {
    const said = await socket.ask(request.name);
    assert.ok(said.answer === request.answer || api.errors.includes(said.error.code),
        `${request.name}: ${JSON.stringify(said)}`);
    ++asked;
}
console.log(`asked ${asked} requests`);

const watcher = await Socket.connect(link, '&changes=1');
assert.equal((await watcher.next()).changes.whole, true);
const moved = await socket.ask('MoveNode', {node: '/thing', translation: [4, 5, 6]});
assert.equal(moved.answer, 'Committed', JSON.stringify(moved));

const corners = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer);
const indices = Buffer.from(new Uint32Array([0, 1, 2]).buffer);
const made = await socket.ask('ProposeChanges', {list: {
    created: [{id: '$0', type: 'Node'}, {id: '$1', type: 'Geometry'}],
    placed: [{node: '$0', parent: 1}],
    set: [{type: 'Node', field: 'name', ids: ['$0'], values: ['made']},
        {type: 'Node', field: 'core', ids: ['$0'], values: ['$1']},
        {type: 'Geometry', field: 'positions', ids: ['$1'], values: [{binary: 0}]},
        {type: 'Geometry', field: 'indices', ids: ['$1'], values: [{binary: 1}]}],
}}, corners, indices);
assert.equal(made.answer, 'Committed', JSON.stringify(made));

let told = '';
while (!told.includes('"made"')) {
    const said = await watcher.next();
    assert.notEqual(said, null);
    told += JSON.stringify(said);
}
assert.match(told, /"translation","ids":\[\d+\],"values":\[\[4,5,6\]\]/);
const refused = await socket.ask('RemoveNode', {node: 1});
assert.equal(refused.error.code, 'refused', JSON.stringify(refused));
await socket.ask('SubscribeNews', {frames: true});
const frame = await socket.next();
assert.equal(frame.notice, 'Frame');
console.log(`moved /thing and made /made; frame ${frame.fields.frame} was shown`);
socket.close();
watcher.close();
