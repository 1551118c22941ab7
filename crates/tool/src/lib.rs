//! What the programs of cotan share: the command line and the editor.
