// A WebSocket in plain JavaScript (RFC 6455, node's sockets alone): texts are JSON, binary frames are Buffers.
import crypto from 'node:crypto';
import http from 'node:http';

export class Socket {
    static connect(link, more = '') {
        const url = new URL(link);
        const key = crypto.randomBytes(16).toString('base64');
        const token = url.searchParams.get('token');
        return new Promise((resolve, reject) => {
            const request = http.request({host: url.hostname, port: url.port, path: `/socket?token=${token}${more}`,
                headers: {Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13',
                    'Sec-WebSocket-Key': key}});
            request.on('upgrade', (response, socket, head) => resolve(new Socket(socket, head)));
            request.on('response', response => reject(new Error(`refused: ${response.statusCode}`)));
            request.on('error', reject);
            request.end();
        });
    }
    constructor(socket, head) {
        this.socket = socket;
        this.bytes = head;
        this.messages = [];
        this.waiting = [];
        this.parts = [];
        this.last = 0;
        socket.on('data', data => { this.bytes = Buffer.concat([this.bytes, data]); this.#read(); });
        socket.on('close', () => this.#give(null));
    }
    send(json, ...binaries) {
        if (binaries.length) json.binaries = binaries.length;
        this.#frame(1, Buffer.from(JSON.stringify(json)));
        for (const each of binaries) this.#frame(2, each);
    }
    next() { return new Promise(resolve => { this.waiting.push(resolve); this.#hand(); }); }
    /** What answers a request; notices before it are dropped. */
    async ask(request, fields = {}, ...binaries) {
        const id = ++this.last;
        this.send({id, request, fields}, ...binaries);
        for (;;) {
            const said = await this.next();
            if (said === null || said.id === id) return said;
        }
    }
    close() { this.socket.destroy(); }

    #frame(code, payload) {
        const long = payload.length > 65535, short = payload.length < 126;
        const head = Buffer.alloc(short ? 2 : long ? 10 : 4);
        head[0] = 0x80 | code;
        head[1] = 0x80 | (short ? payload.length : long ? 127 : 126);
        if (!short && !long) head.writeUInt16BE(payload.length, 2);
        if (long) head.writeBigUInt64BE(BigInt(payload.length), 2);
        const mask = crypto.randomBytes(4);
        this.socket.write(Buffer.concat([head, mask, payload.map((byte, i) => byte ^ mask[i % 4])]));
    }
    #read() {
        for (;;) {
            if (this.bytes.length < 2) return;
            let size = this.bytes[1] & 127, at = 2;
            if (size >= 126) {
                at = size === 126 ? 4 : 10;
                if (this.bytes.length < at) return;
                size = at === 4 ? this.bytes.readUInt16BE(2) : Number(this.bytes.readBigUInt64BE(2));
            }
            if (this.bytes.length < at + size) return;
            const code = this.bytes[0] & 15, whole = this.bytes[0] & 128, payload = this.bytes.subarray(at, at + size);
            this.bytes = this.bytes.subarray(at + size);
            if (code === 9) this.#frame(10, payload);
            if (code > 2) continue;
            if (code) this.code = code;
            this.parts.push(payload);
            if (!whole) continue;
            const all = Buffer.concat(this.parts);
            this.parts = [];
            this.#give(this.code === 1 ? JSON.parse(all.toString()) : all);
        }
    }
    #give(message) { this.messages.push(message); this.#hand(); }
    #hand() { while (this.messages.length && this.waiting.length) this.waiting.shift()(this.messages.shift()); }
}
