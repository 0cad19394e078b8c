import './styles/main.css';
import { exposeStatus } from './page_status';
import { whenTokenWanted } from './server/access';
import { SessionPage } from './session/session_page';
import { Overview } from './sessions/overview';
import { AccessPage } from './ui/access_page';
import { element } from './ui/dom';
import type { Page } from './ui/page';

const SESSION_ADDRESS = /^#\/sessions\/([A-Za-z0-9_-]{1,64})$/;

/** `#/sessions/ID` is a session, anything else the overview. */
function pageOf(address: string): Page {
  const session = SESSION_ADDRESS.exec(address)?.[1];
  return session === undefined ? new Overview() : new SessionPage(session);
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
  const show = (make: () => Page) => {
    page?.close();
    page = make();
    heading.replaceChildren(page.heading);
    slot.replaceChildren(page.root);
    page.shown?.();
  };
  const navigate = () => show(() => pageOf(window.location.hash));
  whenTokenWanted((text) => {
    // Several requests of one page may be refused together.
    if (!(page instanceof AccessPage)) show(() => new AccessPage(text, navigate));
  });
  window.addEventListener('hashchange', navigate);
  navigate();
}

exposeStatus();
const app = document.getElementById('app');
if (app !== null) start(app);
