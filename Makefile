# Every target installs what it needs first. See CONTRIBUTING for what runs when.
CARGO ?= cargo

SCENE ?= scenes/ajar/ajar.pbrt

.PHONY: all render study test test-long try-engines bench replay lint deps clean

all: deps
	$(CARGO) build --release

# The picture of this project: Veach's door, a little open.
render: all
	mkdir -p out
	target/release/metrolux render scenes/ajar/ajar.pbrt -o out/ajar.exr -o out/ajar.png

# What accuracy costs in time, a page for each of four scenes: out/study/NAME/index.html. Goes on where it stopped.
STUDY_BUDGET ?= 10m
study: all
	for s in ajar/ajar caustic/caustic-x1 pool/pool cornell/cornell; do \
		target/release/metrolux study scenes/$$s.pbrt -o out/study/$${s##*/} --budget $(STUDY_BUDGET) \
			-- --resolution $$(case $$s in (ajar*) echo 128x72;; (*) echo 96x96;; esac) || exit; \
	done

test: deps
	$(CARGO) test

# Tests that take minutes, among them those marked #[ignore].
test-long: deps
	$(CARGO) test --release -- --include-ignored

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

deps:
	@sh ffi/install-deps.sh

clean:
	$(CARGO) clean
