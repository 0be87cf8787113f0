// Files on their way to the wall: a row for each set with how far it is, and a button that stops it.
import { element, setText } from './elements.js';
import { sizeText, transfer, uploadPath } from './transfer.js';

export class UploadList {
  node = element('ul', { class: 'transfers', 'aria-label': 'Files on their way' });

  /**
   * One after the other, all or none.
   * @param {string} title
   * @param {{name: string, file: File}[]} files
   * @returns {Promise<string[] | null>} where they lie at the server; null: they do not, and the row says why
   */
  async send(title, files) {
    const total = files.reduce((sum, { file }) => sum + file.size, 0);
    const bar = element('progress', { max: Math.max(total, 1), value: 0, 'aria-label': title });
    const said = element('span', { class: 'muted' });
    let current = null, isStopped = false;
    const stop = element('button', { type: 'button', text: '✕ Stop', 'aria-label': `Stop ${title}`, onclick: () => {
      isStopped = true;
      current?.stop();
    } });
    const row = element('li', {}, element('span', { class: 'name', text: title }), bar, said, stop);
    this.node.append(row);
    const paths = [];
    let before = 0;
    try {
      for (const { name, file } of files) {
        if (isStopped) throw new Error('Stopped.');
        current = transfer({ method: 'PUT', path: uploadPath(name), body: file }, (part) => {
          bar.value = before + part * file.size;
          setText(said, `${sizeText(bar.value)} of ${sizeText(total)}`);
        });
        paths.push((await current.done).path);
        before += file.size;
      }
      row.remove();
      return paths;
    } catch (error) {
      for (const { name } of files.slice(0, paths.length))  // half a set is of no use
        transfer({ method: 'DELETE', path: uploadPath(name) }).done.catch(() => {});
      bar.remove();
      said.className = 'said';
      setText(said, `✕ ${error.message}`);
      setText(stop, 'Close');
      stop.setAttribute('aria-label', `Close ${title}`);
      stop.onclick = () => row.remove();
      return null;
    }
  }
}
