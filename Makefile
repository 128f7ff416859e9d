# Talus. `make` prints the targets.
JOBS ?= $(shell nproc)
PRESET ?= release
BUILD := build/$(PRESET)

.PHONY: help setup build test verify demo cases bench reference docs fuzz deb
.PHONY: format format-check lint lint-changed clean

help:
	@echo "make demo    install what is missing, build, run the demo case, name the report to open"
	@echo "make test    install what is missing, build, run every test"
	@echo "make build   build alone: the program is build/release/talus"
	@echo "make verify  every row of talus verify, against what docs/results says falls short (some minutes)"
	@echo "make cases   run every case in full (long)"
	@echo "make bench   benchmarks: contact solver, kernels, scenes beside Bullet, ODE (docs/results/peers.md)"
	@echo "make reference  docs/scene.md, docs/theory/tolerances.md, docs/talus.1 by the program (seconds)"
	@echo "make docs    the same, and the tables and plots of talus verify in docs/results/ (some ten minutes)"
	@echo "make fuzz    fuzz the readers, ten minutes of CPU time each (needs clang and libclang-rt-14-dev)"
	@echo "make deb     the Debian package: build/deb/talus_*.deb"
	@echo "make format  clang-format of all C++ files; make format-check looks alone"
	@echo "make lint    clang-tidy of all sources (long); make lint-changed of those that differ from BASE"
	@echo "make clean   remove build/"

setup:
	@scripts/setup.sh

# The program and its modules; the tests are built by `make test`. First the report's page, whose npm packages
# come over the network: what is missing there is told at once.
build:
	@test -f $(BUILD)/build.ninja || cmake --preset $(PRESET)
	@cmake --build $(BUILD) --target talus_report_page
	@cmake --build $(BUILD) -j $(JOBS) --target talus_program

test: setup
	@test -f $(BUILD)/build.ninja || cmake --preset $(PRESET)
	@cmake --build $(BUILD) --target talus_report_page
	@cmake --build $(BUILD) -j $(JOBS)
	@ctest --test-dir $(BUILD) --output-on-failure -j $(JOBS)

verify: build
	@for suite in dda fem coupling stability invariants; do \
	  python3 tests/verify/run.py $(BUILD)/talus $$suite docs/results/verification-$$suite.md \
	    $(BUILD)/verify-$$suite --full || exit 1; done

demo: setup build
	@$(BUILD)/talus run cases/tirol-pier/reinforced.toml -o results/tirol-pier
	@echo "Open results/tirol-pier/report.html in a browser."

cases: build
	@cases/run_all.sh

bench: build
	@cmake --build $(BUILD) -j $(JOBS) --target bench
	@$$(find $(BUILD) -name talus_solver_bench -type f)
	@$$(find $(BUILD) -name talus_kernel_bench -type f)
	@python3 bench/run.py --peers bullet64,ode s1 s2 s4 s3-100

reference: build
	@$(BUILD)/talus explain --all --markdown > docs/scene.md
	@$(BUILD)/talus explain --tolerances > docs/theory/tolerances.md
	@$(BUILD)/talus --man > docs/talus.1

docs: reference
	@scripts/results.sh $(BUILD)

deb: setup build
	@cd $(BUILD) && cpack -G DEB -B $(CURDIR)/build/deb > $(CURDIR)/build/deb.log || \
	  { tail -20 $(CURDIR)/build/deb.log; exit 1; }
	@ls $(CURDIR)/build/deb/*.deb

format:
	@scripts/format.sh fix

format-check:
	@scripts/format.sh check

lint:
	@scripts/lint.sh $(BUILD) all

lint-changed:
	@scripts/lint.sh $(BUILD) changed $(BASE)

fuzz:
	@test -f build/fuzz/build.ninja || cmake --preset fuzz
	@cmake --build build/fuzz -j $(JOBS) --target talus_fuzz
	@python3 tests/fuzz/run.py build/fuzz

clean:
	rm -rf build
