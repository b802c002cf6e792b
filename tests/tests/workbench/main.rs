//! The workbench: who is let in, how it ends, and the loop on its page in a browser.

mod axe;
mod bench;
mod board;
mod campaign;
mod dropped;
mod ending;
mod ends;
mod firefox;
mod keyboard;
mod law;
mod lesson;
mod live;
mod looks;
mod measured;
mod module;
mod page;
mod phone;
mod plug;
mod refusals;
mod replay;
mod still;
mod tabs;
mod together;
