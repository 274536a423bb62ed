/**
 * Runs in Viser's page, around the workbench: a frame that outlives what Viser draws, and one key
 * map for the whole page. Knows nothing of pairs and masks.
 */
import { WorkbenchFrame } from "./frame.js";
import { shareKeys } from "./keys.js";

const frame = new WorkbenchFrame();
frame.start();
shareKeys(frame);
