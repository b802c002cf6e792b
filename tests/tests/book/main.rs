//! README and book: every command runs as it stands there, every link leads somewhere, and what is drawn or
//! listed from the project is as the project is now.

mod commands;
mod drawn;
mod links;
mod pages;
