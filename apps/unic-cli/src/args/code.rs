//! How the motion's code is picked, for every command that runs a model.

use unic_core::network::CodeSampling;

/// How the categories of the motion's code are picked.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct CodeArgs {
    /// Pick the categories of the motion's code with Gumbel noise of this scale, 0 to 1, as the authors' release
    /// does [default: no noise, the largest logit].
    #[arg(long, value_name = "SCALE", value_parser = scale)]
    pub(crate) gumbel: Option<f32>,
    /// Seed of that noise.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "gumbel")]
    gumbel_seed: u64,
}

impl CodeArgs {
    pub(crate) fn sampling(self) -> CodeSampling {
        let seed = self.gumbel_seed;
        self.gumbel
            .map_or(CodeSampling::Largest, |scale| CodeSampling::Gumbel {
                scale,
                seed,
            })
    }
}

fn scale(text: &str) -> Result<f32, String> {
    let scale: Option<f32> = text.parse().ok().filter(|s| (0.0..=1.0).contains(s));
    scale.ok_or_else(|| "expected a number from 0 to 1".to_owned())
}
