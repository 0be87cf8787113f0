// Where a panel's page begins: what whose token is of a panel sees instead of the console.
import { startBanner } from './banner.js';
import { PanelLink } from './panel-link.js';
import { startPanel } from './panel-view.js';
import { startTheme } from './theme.js';
import { takeToken } from './token.js';

takeToken();
startTheme(document.getElementById('theme'));
const link = new PanelLink();
startBanner(document.getElementById('banner'), link);
startPanel(link);
link.dial();
