// What somebody drops or chooses, as files with the names that they get at the server.

const kMost = 1024;
/** Files that models name, and that are none themselves: a set is not called after them. */
const kCompanions =
  /\.(bin|arrays|mtl|png|jpe?g|web[pm]|gif|bmp|tga|tiff?|dds|ktx2?|astc|pkm|hdr|exr|z?raw|txt|md|json|mp4|mov|avi)$/i;

/**
 * A drop may hold folders. To be called while the event is dispatched: its items are gone afterwards.
 * @param {DataTransfer} data
 * @returns {Promise<{name: string, file: File}[]>}
 */
export async function filesOf(data) {
  const entries = [...data.items].filter((item) => item.kind === 'file').map((item) => item.webkitGetAsEntry?.());
  if (entries.some((entry) => !entry)) return [...data.files].map((file) => ({ name: file.name, file }));
  const found = [];
  for (const entry of entries) await collect(entry, entry.name, found);
  return found;
}

async function collect(entry, name, found) {
  if (found.length >= kMost || entry.name.startsWith('.')) return;
  if (entry.isFile) {
    found.push({ name, file: await new Promise((resolve, reject) => entry.file(resolve, reject)) });
    return;
  }
  const reader = entry.createReader();
  while (true) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return;
    for (const inner of some) await collect(inner, `${name}/${inner.name}`, found);
  }
}

/**
 * Several files belong together: they get a folder, called after the model among them.
 * @param {{name: string, file: File}[]} files
 */
export function asSet(files) {
  const tops = new Set(files.map(({ name }) => name.split('/')[0]));
  if (tops.size <= 1) return files;
  const main = (files.find(({ name }) => !kCompanions.test(name)) ?? files[0]).name.split('/')[0];
  const set = main.replace(/\.[^.]*$/, '') || 'files';
  return files.map(({ name, file }) => ({ name: `${set}/${name}`, file }));
}
