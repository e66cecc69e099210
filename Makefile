# Every target installs what it needs first. See CONTRIBUTING for what runs when.
CARGO ?= cargo

SCENE ?= scenes/ajar/ajar.pbrt

.PHONY: all profiled render study verify-double test test-long try-engines bench replay lint deps clean

all: deps
	$(CARGO) build --release

# The same program, compiled by what a first build of it was seen to do (profile-guided optimisation): to the bit the same
# images in less time. Takes rustup's llvm-tools, whose llvm-profdata is of the compiler's version, and ten minutes.
PROFILE = $(CURDIR)/target/profile
HOST = $(shell rustc -vV | sed -n 's/^host: //p')
PROFDATA = $(shell rustc --print sysroot)/lib/rustlib/$(HOST)/bin/llvm-profdata
PROFILED_BUILD = $(CARGO) build --release --bin metrolux --target $(HOST) --target-dir
TRAINING = --quiet --resolution 96x64 -o $(PROFILE)/out.exr

profiled: deps
	[ -x "$(PROFDATA)" ] || rustup component add llvm-tools
	rm -rf $(PROFILE)/raw
	RUSTFLAGS="-C target-cpu=native -C profile-generate=$(PROFILE)/raw" $(PROFILED_BUILD) $(PROFILE)/first
	for s in ajar/ajar cornell/cornell cornell-glass/cornell-glass pool/pool caustic/caustic-x4 prism/prism; do \
		for a in embree obvhs; do for o in '--lanes 4 --mutations 100' '--lanes 1 --mutations 20' '--lanes 8 --mutations 10' \
			'--lanes 16 --mutations 10' '--integrator bdpt --spp 8' '--integrator pt --spp 16'; do \
			$(PROFILE)/first/$(HOST)/release/metrolux render scenes/$$s.pbrt --accel $$a $$o $(TRAINING) || exit; done; done; done
	$(PROFDATA) merge -o $(PROFILE)/metrolux.profdata $(PROFILE)/raw
	RUSTFLAGS="-C target-cpu=native -C profile-use=$(PROFILE)/metrolux.profdata" $(PROFILED_BUILD) $(PROFILE)
	mkdir -p target/profiled
	cp $(PROFILE)/$(HOST)/release/metrolux target/profiled

# The picture of this project: Veach's door, a little open.
render: all
	mkdir -p out
	target/release/metrolux render scenes/ajar/ajar.pbrt -o out/ajar.exr -o out/ajar.png

# What accuracy costs in time, a page for each of four scenes: out/study/NAME/index.html. Goes on where it stopped. Two at
# once on a machine of two cores: make -j2 study STUDY_OPTIONS='--clock cpu' STUDY_RENDER='--threads 1'
STUDY_BUDGET ?= 10m
STUDY_OPTIONS ?=
STUDY_RENDER ?=
STUDIES = $(addprefix study/,ajar/ajar caustic/caustic-x1 pool/pool cornell/cornell)

.PHONY: $(STUDIES)
study: $(STUDIES)

$(STUDIES): study/%: all
	target/release/metrolux study scenes/$*.pbrt -o out/study/$(notdir $*) --budget $(STUDY_BUDGET) $(STUDY_OPTIONS) \
		-- --resolution $(if $(findstring ajar,$*),128x72,96x96) $(STUDY_RENDER)

# By how much f32 deviates from f64 on each scene, in out/double: steps of the one build made again by the other.
DOUBLE = target/double/release/metrolux
DOUBLE_STEPS ?= 1000
DOUBLE_OPTIONS ?=
DOUBLE_SCENES = ajar/ajar $(foreach z,1 4 16 64,caustic/caustic-x$z) cornell/cornell cornell-glass/cornell-glass \
	$(addprefix furnace/,emission four-points point) pool/pool prism/prism

.PHONY: $(DOUBLE)
$(DOUBLE): deps
	$(CARGO) build --release --features double --target-dir target/double

verify-double: all $(DOUBLE)
	mkdir -p out/double
	for s in $(DOUBLE_SCENES); do n=out/double/$${s#*/}; \
		target/release/metrolux verify scenes/$$s.pbrt $(DOUBLE_OPTIONS) --steps $(DOUBLE_STEPS) --keep-steps $$n.steps > $$n.verify \
		|| echo "see $$n.verify"; $(DOUBLE) verify scenes/$$s.pbrt $(DOUBLE_OPTIONS) --against $$n.steps > $$n.txt; c=$$?; \
		echo "$$s"; cat $$n.txt; [ $$c = 0 ] || exit $$c; done

test: deps
	$(CARGO) test

# Tests that take minutes, among them those marked #[ignore], but for one that writes files of the repository; and the modules
# with transport in f64.
test-long: $(DOUBLE)
	METROLUX_DOUBLE=$(CURDIR)/$(DOUBLE) $(CARGO) test --release -- --include-ignored --skip write_the_corpus
	$(CARGO) test --release --lib --features double --target-dir target/double

# Jobs of `metrolux job` on the engines themselves, where they are installed.
try-engines: all
	bash tests/engines/slurm.sh
	bash tests/engines/openjd.sh

bench: deps
	$(CARGO) bench

# What a render costs over the bare Embree calls it makes: make replay SCENE=FILE
replay: deps
	METROLUX_SCENE="$(SCENE)" $(CARGO) bench --bench replay

lint: deps
	$(CARGO) fmt --check
	$(CARGO) clippy --all-targets -- -D warnings
	$(CARGO) clippy --features double -- -D warnings

deps:
	@sh ffi/install-deps.sh

clean:
	$(CARGO) clean
