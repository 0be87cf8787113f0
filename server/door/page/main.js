// Where the page begins: what it holds is made here, once, and connected.
import { Connection } from './connection.js';
import { FilesView } from './files-view.js';
import { startHeader } from './header.js';
import { News } from './news.js';
import { PlanView } from './plan-view.js';
import { Schema } from './schema.js';
import { SceneView } from './scene-view.js';
import { startTabs } from './tabs.js';
import { startTheme } from './theme.js';
import { TimeView } from './time-view.js';
import { takeToken } from './token.js';
import { WallStatus } from './wall-status.js';
import { WallView } from './wall-view.js';

takeToken();
startTheme(document.getElementById('theme'));
const connection = new Connection();
const news = new News(connection);
const status = new WallStatus(connection, news);
const schema = new Schema(connection);
startHeader(connection, status, schema);
const showInScene = (node) => {
  document.getElementById('tab-scene').click();
  views.scene.show(node);
};
const views = {
  wall: new WallView(document.getElementById('panel-wall'), connection, status, showInScene),
  plan: new PlanView(document.getElementById('panel-plan'), connection, status, news),
  time: new TimeView(document.getElementById('panel-time'), connection, status),
  scene: new SceneView(document.getElementById('panel-scene'), connection, status, schema),
  files: new FilesView(document.getElementById('panel-files'), connection),
};
startTabs(document.getElementById('tabs'), (name) => {
  for (const [other, view] of Object.entries(views)) view.isShown = other === name;
});
connection.dial();
