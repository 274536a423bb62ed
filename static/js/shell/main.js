/**
 * Runs in Viser's page, around the workbench: a frame that outlives what Viser draws. Knows
 * nothing of pairs and masks.
 */
import { WorkbenchFrame } from "./frame.js";

const frame = new WorkbenchFrame();
frame.start();
