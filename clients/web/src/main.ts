import './styles/main.css';
import { exposeStatus } from './page_status';
import { SessionPage } from './session/session_page';
import { SessionList } from './sessions/session_list';
import { element } from './ui/dom';
import type { Page } from './ui/page';

const SESSION_ADDRESS = /^#\/sessions\/([A-Za-z0-9_-]{1,64})$/;

/** `#/sessions/ID` is a session, anything else the list. */
function pageOf(address: string): Page {
  const session = SESSION_ADDRESS.exec(address)?.[1];
  return session === undefined ? new SessionList() : new SessionPage(session);
}

function start(app: HTMLElement): void {
  const slot = element('div', { class: 'page' });
  const home = element(
    'a',
    { href: '#/', class: 'home', 'aria-label': 'MIS-SLAM, all sessions' },
    'MIS-SLAM',
  );
  const heading = element('div', { class: 'heading' });
  app.append(element('header', { class: 'bar' }, home, heading), slot);
  let page: Page | undefined;
  const navigate = () => {
    page?.close();
    page = pageOf(window.location.hash);
    heading.replaceChildren(page.heading);
    slot.replaceChildren(page.root);
  };
  window.addEventListener('hashchange', navigate);
  navigate();
}

exposeStatus();
const app = document.getElementById('app');
if (app !== null) start(app);
