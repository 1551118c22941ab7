//! The command line.

use std::error::Error;
use std::path::PathBuf;

use cotan::shapes::VertexOrder;

pub(crate) struct Options {
    pub(crate) sizes: Vec<usize>,
    pub(crate) growth: Vec<usize>,
    pub(crate) threads: Vec<usize>,
    pub(crate) rounds: usize,
    pub(crate) numbering: VertexOrder,
    pub(crate) peers: PathBuf,
    pub(crate) python: String,
    pub(crate) json: Option<PathBuf>,
}

impl Options {
    pub(crate) fn parse(words: &[String]) -> Result<Self, Box<dyn Error>> {
        let mut options = Self {
            sizes: vec![14_000, 100_000],
            growth: vec![],
            threads: vec![1, 2],
            rounds: 3,
            numbering: VertexOrder::Random,
            peers: "benches/peers/build".into(),
            python: "python3".into(),
            json: None,
        };
        let mut words = words.iter();
        while let Some(name) = words.next() {
            let value = words.next().ok_or(format!("{name} needs a value"))?;
            match name.as_str() {
                "--sizes" => options.sizes = numbers(value)?,
                "--growth" => options.growth = numbers(value)?,
                "--threads" => options.threads = numbers(value)?,
                "--rounds" => options.rounds = value.parse()?,
                "--numbering" => {
                    options.numbering = match value.as_str() {
                        "random" => VertexOrder::Random,
                        "natural" => VertexOrder::Natural,
                        other => return Err(format!("no numbering is named {other}").into()),
                    }
                }
                "--peers" => options.peers = value.into(),
                "--python" => options.python = value.into(),
                "--json" => options.json = Some(value.into()),
                other => return Err(format!("there is no option {other}").into()),
            }
        }
        Ok(options)
    }
}

fn numbers(list: &str) -> Result<Vec<usize>, Box<dyn Error>> {
    list.split(',')
        .filter(|word| !word.is_empty())
        .map(|word| Ok(word.trim().parse()?))
        .collect()
}
