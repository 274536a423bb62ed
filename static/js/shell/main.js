/**
 * Runs in Viser's page, around the workbench: a frame that outlives what Viser draws, the drawer and
 * the map beside it, and one key map for the whole page. Knows nothing of pairs and masks.
 */
import { Arrangement } from "./arrangement.js";
import { WorkbenchFrame } from "./frame.js";
import { shareKeys } from "./keys.js";
import { turnTo } from "./tabs.js";

const frame = new WorkbenchFrame();
frame.start();
new Arrangement(frame.element).start();
shareKeys(frame, () => turnTo("Workbench"));
