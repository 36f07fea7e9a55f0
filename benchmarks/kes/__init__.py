"""Fast Ergodic Search with Kernel Functions (Sun, Gaggar, Trautman, Murphey; KES), claim by claim.

    python -m benchmarks.kes             all of it (some minutes)
    python -m benchmarks.kes.coverage    one

Each prints what the paper claims beside what is found here, and draws it under `figures/`. At hand were the paper's
abstract, the beginning of its public text, this project's notes on its equations and figures of the authors' public
tutorial, not its tables: claims go by their subject, and where a setting is not known, the script says what it takes.
What is measured is the product's own metric, whose density is blurred where the paper's is not
(`planner.kernel_metric`).

| file        | claim                                                                                           |
|-------------|-------------------------------------------------------------------------------------------------|
| `cost`      | linear in the dimension where the Fourier metric is exponential; quadratic in the samples       |
| `parameter` | the kernel's parameter by eq. (30) makes the metric asymptotically consistent                   |
| `coverage`  | coverage as good as the Fourier metric's                                                        |
| `poses`     | Lie groups: places and headings                                                                 |
| `control`   | optimal control under the metric (here SVES Alg. 2)                                             |
| `examples`  | (not the paper's) what `metric = "kernel"` in a mission file gives                              |
"""
