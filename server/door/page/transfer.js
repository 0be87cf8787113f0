// Files between this browser and the wall: with progress, and with a way to stop. The token goes in the head, so that
// no address holds it.
import { authorization } from './token.js';

/** What the server says of a transfer that it refuses, or that it does not end. */
export class TransferError extends Error {
  /** @param {string} message @param {boolean} wasStopped by whoever looks at the page */
  constructor(message, wasStopped = false) {
    super(message);
    this.wasStopped = wasStopped;
  }
}

/**
 * @param {{method: string, path: string, body?: Blob, answers?: XMLHttpRequestResponseType}} what
 * @param {(part: number, bytes: number) => void} onProgress `part` from 0 to 1
 * @returns {{done: Promise<any>, stop: () => void}}
 */
export function transfer({ method, path, body, answers = 'json' }, onProgress = () => {}) {
  const request = new XMLHttpRequest();
  const done = new Promise((resolve, reject) => {
    request.open(method, path);
    request.responseType = answers;
    for (const [name, value] of Object.entries(authorization())) request.setRequestHeader(name, value);
    const told = ({ loaded, total }) => onProgress(total ? loaded / total : 0, loaded);
    (body ? request.upload : request).onprogress = told;
    request.onload = async () => {
      if (request.status < 400) resolve(request.response);
      else reject(new TransferError(await reason(request)));
    };
    request.onerror = () => reject(new TransferError('The wall has not taken it: the connection broke off.'));
    request.onabort = () => reject(new TransferError('Stopped.', true));
    request.send(body);
  });
  return { done, stop: () => request.abort() };
}

async function reason(request) {
  try {
    const said = request.response instanceof Blob ? JSON.parse(await request.response.text()) : request.response;
    return said.error.message;
  } catch {
    return `The wall refuses it (${request.status}).`;
  }
}

/** @param {string} name one or more, with / between them */
export function uploadPath(name) {
  return `/upload/${name.split('/').map(encodeURIComponent).join('/')}`;
}

/** Lets the browser keep what has come, as a file of that name. */
export function keepAsFile(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

const kUnits = ['bytes', 'KiB', 'MiB', 'GiB'];
/** @param {number} bytes */
export function sizeText(bytes) {
  let unit = 0;
  for (; bytes >= 1024 && unit < kUnits.length - 1; ++unit) bytes /= 1024;
  return `${unit === 0 ? bytes : bytes.toFixed(bytes < 10 ? 1 : 0)} ${kUnits[unit]}`;
}
