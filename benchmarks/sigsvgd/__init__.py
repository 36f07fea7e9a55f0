"""Path Signatures for Diversity in Probabilistic Trajectory Optimisation: its experiments in the plane.

SigSVGD, by Barcelos, Lai, Oliveira, Borges and Ramos, 2023; and its kernel in the product.

    python -m benchmarks.sigsvgd                      all of them (some minutes)
    python -m benchmarks.sigsvgd.motion_planning      one

At hand were the paper's abstract, this project's notes on its settings, and the settings in the authors' public code
(github.com/lubaroli/sigsvgd: starts, targets, costs, numbers of particles and steps), which is of other dates than the
paper; not the paper's tables. The claims are those of the abstract, by subject. What is taken beyond that, each script
says. The arm among shelves, the paper's third experiment, is left out: the product has no arm.

| script            | what it shows here                                                                  |
|-------------------|-------------------------------------------------------------------------------------|
| `motion_planning` | twenty paths over hilly ground: cost and diversity by kernel, same starts and steps |
| `navigation`      | a point mass through a grid of pillars, receding horizon, beside MPPI               |
| `product_forest`  | the product's solver with each kernel in `examples/forest.toml`                     |

Kernels: the paper's as printed (k itself, a static kernel of fixed bandwidth: 1.5 and √32); the product's
(`planner.signature_kernel`, which follows the set); the product's with each candidate on its own score; RBF on the
parameters (knots or controls), which is plain SVGD; Markov RBF on the path; the identity, which is independent descent.
"""
