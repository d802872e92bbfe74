//! One HTML file a person opens by double click.
