// The native link in plain JavaScript, after proto/WIRE.md: what is needed to ask and to be told. All numbers, names
// and members come from what `tessera-ctl requests --json` prints.
import net from 'node:net';

import {xxh3} from './xxh3.mjs';

// ---- heads and parts

export function varint(value) {
    const bytes = [];
    for (let left = BigInt(value); ; left >>= 7n) {
        if (left < 128n) return Buffer.from([...bytes, Number(left)]);
        bytes.push(Number(left & 127n) | 128);
    }
}
const tag = (number, kind) => varint(number * 8 + kind);
const eight = value => {
    const bytes = Buffer.alloc(8);
    bytes.writeBigUInt64LE(BigInt.asUintN(64, BigInt(value)));
    return bytes;
};
const double = value => { const bytes = Buffer.alloc(8); bytes.writeDoubleLE(value); return bytes; };
const within = (number, bytes) => Buffer.concat([tag(number, 2), varint(bytes.length), bytes]);

export function* fieldsOf(head) {
    let at = 0;
    const take = () => {
        for (let value = 0n, shift = 0n; ; shift += 7n) {
            const byte = head[at++];
            value |= BigInt(byte & 127) << shift;
            if (byte < 128) return value;
        }
    };
    while (at < head.length) {
        const [number, kind] = (key => [Number(key >> 3n), Number(key & 7n)])(take());
        if (kind === 0) yield [number, kind, take()];
        else if (kind === 1) yield [number, kind, head.subarray(at, at += 8)];
        else if (kind === 2) { const size = Number(take()); yield [number, kind, head.subarray(at, at += size)]; }
        else throw new Error(`a field of kind ${kind}`);
    }
}

export function joinParts(head, parts) {
    const begin = Buffer.alloc(8);
    begin.writeUInt32LE(head.length);
    begin.writeUInt32LE(parts.length, 4);
    return Buffer.concat([begin, ...parts.map(part => eight(part.length)), head, ...parts]);
}
export function splitParts(bytes) {
    const headSize = bytes.readUInt32LE(), count = bytes.readUInt32LE(4), parts = [];
    let at = 8 + 8 * count;
    const head = bytes.subarray(at, at += headSize);
    for (let i = 0; i < count; ++i) {
        const size = Number(bytes.readBigUInt64LE(8 + 8 * i));
        parts.push(bytes.subarray(at, at += size));
    }
    if (at !== bytes.length) throw new Error('bytes are left over');
    return {head, parts};
}

// ---- messages

export function framed(number, epoch, payload) {
    const header = Buffer.alloc(32);
    header.write('TSRA');
    header.writeUInt16LE(1, 4);
    header.writeUInt16LE(number, 6);
    header.writeUInt32LE(payload.length, 8);
    header.writeBigUInt64LE(epoch, 16);
    header.writeBigUInt64LE(xxh3(payload, xxh3(header.subarray(0, 24))), 24);
    return Buffer.concat([header, payload]);
}
/** Of a whole message: {number, epoch, payload}. */
export function unframed(bytes) {
    const payload = bytes.subarray(32);
    if (bytes.toString('latin1', 0, 4) !== 'TSRA' || bytes.readUInt32LE(8) !== payload.length)
        throw new Error('no message');
    if (bytes.readBigUInt64LE(24) !== xxh3(payload, xxh3(bytes.subarray(0, 24))))
        throw new Error('the checksum is wrong');
    return {number: bytes.readUInt16LE(6), epoch: bytes.readBigUInt64LE(16), payload};
}

export function encodeMessage(fields, values) {
    const head = [], parts = [];
    for (const {name, form, number} of fields) {
        const value = values[name];
        if (form === 'bytes' || form === 'records') parts.push(value ?? Buffer.alloc(0));
        else if (!value || value === 0n) continue;
        else if (form === 'varint') head.push(tag(number, 0), varint(value));
        else if (form === 'fixed') head.push(tag(number, 1), eight(value));
        else if (form === 'text') head.push(within(number, Buffer.from(value)));
        else if (form === 'hash') value.forEach((word, i) => word && head.push(tag(number + i, 1), eight(word)));
    }
    return joinParts(Buffer.concat(head), parts);
}
export function decodeMessage(fields, payload) {
    const {head, parts} = splitParts(payload), found = {}, values = {};
    for (const [number, kind, value] of fieldsOf(head)) found[number] = kind === 1 ? value.readBigUInt64LE() : value;
    for (const {name, form, number} of fields) {
        if (form === 'varint' || form === 'fixed') values[name] = found[number] ?? 0n;
        else if (form === 'text' || form === 'reason') values[name] = (found[number] ?? Buffer.alloc(0)).toString();
        else if (form === 'hash') values[name] = [found[number] ?? 0n, found[number + 1] ?? 0n];
        else if (form === 'list') [values.list, values.blobs] = [parts.shift(), parts.shift()];
        else if (form !== 'blob') values[name] = parts.shift();
    }
    return values;
}

// ---- requests, answers and notices

const coordinates = {Vector: 3, Rotation: 4};

function membersOf(fields, values) {
    const head = [];
    for (const field of fields) {
        const {name, type, number, many, part} = field, value = values[name];
        if (part || value === undefined) continue;
        const one = each => {
            if (type === 'text') return within(number, Buffer.from(each));
            if (type === 'double') return Buffer.concat([tag(number, 1), double(each)]);
            if (coordinates[type])
                return within(number, Buffer.concat(each.flatMap((x, i) => x ? [tag(i + 1, 1), double(x)] : [])));
            if (field.fields) return within(number, membersOf(field.fields, each));
            const word = field.words && typeof each === 'string' ? field.words.indexOf(each) : Number(each);
            return Buffer.concat([tag(number, 0), varint(word)]);
        };
        for (const each of many ? value : [value]) head.push(one(each));
    }
    return Buffer.concat(head);
}
/** `parts`: Buffers, where the request has some; else as many as it has, empty. */
export function encodeBody(said, values, parts) {
    const own = parts ?? said.fields.filter(field => field.part && !field.rest).map(() => Buffer.alloc(0));
    return joinParts(within(said.number, membersOf(said.fields, values)), own);
}
function readMembers(fields, head) {
    const values = {};
    for (const [number, kind, value] of fieldsOf(head)) {
        const field = fields.find(each => each.number === number && !each.part);
        if (!field) continue;
        const {name, type, many} = field;
        let told = value;
        if (type === 'text') told = value.toString();
        else if (type === 'double') told = value.readDoubleLE();
        else if (type === 'fixed64') told = value.readBigUInt64LE();
        else if (coordinates[type]) {
            told = new Array(coordinates[type]).fill(0);
            for (const [i, , bytes] of fieldsOf(value)) told[i - 1] = bytes.readDoubleLE();
        } else if (field.fields) told = readMembers(field.fields, value);
        else if (field.words) told = field.words[Number(value)];
        if (many) (values[name] ??= []).push(told);
        else values[name] = told;
    }
    return values;
}
/** {name, members, parts} of the answer or notice that it is. */
export function decodeBody(known, body) {
    const {head, parts} = splitParts(body);
    for (const [number, , value] of fieldsOf(head)) {
        const said = known.find(each => each.number === number);
        if (said) return {name: said.name, members: readMembers(said.fields, value), parts};
    }
    throw new Error('it is of another version');
}

// ---- the link

export class Link {
    /** Resolves when it is welcomed. `described`: what `tessera-ctl requests --json` prints; `access`: the word that
     *  lets it in. */
    static connect(address, described, name, access) {
        const link = new Link(described);
        const colon = address.lastIndexOf(':');
        const [host, port] = [address.slice(0, colon), Number(address.slice(colon + 1))];
        return new Promise((resolve, reject) => {
            link.socket = net.connect(port, host, () => link.say('Hello', {
                protocol: described.protocol, schema: BigInt('0x' + described.wire.schema), role: 1,
                channel: 0, name, access}));
            link.socket.on('error', reject);
            link.socket.on('data', bytes => link.received(bytes));
            link.on.Welcome = welcome => {
                link.epoch = welcome.epoch;
                link.beats = setInterval(() => link.say('Heartbeat', {}), Number(welcome.heartbeat_ms));
                resolve(link);
            };
            link.on.Refused = refused => reject(new Error(refused.reason));
        });
    }
    constructor(described) {
        Object.assign(this, {described, epoch: 0n, left: Buffer.alloc(0), waiting: new Map(), last: 0, on: {},
            notice: () => {}});
        this.messages = new Map(described.wire.messages.map(message => [message.name, message]));
    }
    say(name, values) {
        const message = this.messages.get(name);
        this.socket.write(framed(message.number, this.epoch, encodeMessage(message.fields, values)));
    }
    received(bytes) {
        this.left = Buffer.concat([this.left, bytes]);
        while (this.left.length >= 32 && this.left.length >= 32 + this.left.readUInt32LE(8)) {
            const size = 32 + this.left.readUInt32LE(8), {number, payload} = unframed(this.left.subarray(0, size));
            this.left = this.left.subarray(size);
            const message = this.described.wire.messages.find(each => each.number === number);
            const said = decodeMessage(message.fields, payload);
            if (message.name === 'Reply') {
                const {resolve, reject} = this.waiting.get(said.id);
                this.waiting.delete(said.id);
                if (said.error)
                    reject(Object.assign(new Error(said.error), {code: this.described.wire.errors[Number(said.code)]}));
                else resolve(decodeBody(this.described.answers, said.body));
            } else if (message.name === 'Notice') this.notice(decodeBody(this.described.notices, said.body));
            else this.on[message.name]?.(said);
        }
    }
    ask(name, values = {}, parts) {
        const said = this.described.requests.find(each => each.name === name), id = BigInt(++this.last);
        this.say('Request', {id, body: encodeBody(said, values, parts)});
        return new Promise((resolve, reject) => this.waiting.set(id, {resolve, reject}));
    }
    close() {
        clearInterval(this.beats);
        this.socket.end();
    }
}
