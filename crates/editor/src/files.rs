//! Opening, saving and autosaving, without a window.
