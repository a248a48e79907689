(* Each statement of a certificate as a claim of the theorems with its proof. Only `prove` says that one holds: it asks
   the extracted checker. Everything else here says which claim it is, and words the reason where it is refused. *)

open Refusal
open Json

(* By parts: proved for all inputs, and not written by --coq. Among: for a number of neighbours in a box. *)
type source = Proved_here | By_parts | In_box | Among
type t = {
  net : Network.t;
  json : Json.t;
  parts : Proved.part list;
  mutable accepted : Proved.claim list;  (* all of these hold: theorem accepted_hold *)
  mutable log : (Proved.claim * Proved.proof) list;  (* the last one first *)
  norms : (string, Proved.dyadic) Hashtbl.t;  (* product of the norms of a network *)
  uppers : (string * string * (string * int) list, Proved.dyadic * source) Hashtbl.t;
      (* by function, block, neighbours *)
  in_box : (string * string, unit) Hashtbl.t;
      (* functions and blocks whose bound, for any neighbours, is one in a box *)
  mutable unwritten : int;  (* claims that --coq does not write *)
  mutable spectral_norms : int;
  mutable upper_bounds : int;
  mutable lower_bounds : int;
  mutable values : int;  (* functions whose values over a box were checked *)
  mutable not_checked : string list;
}

(* By the first of these proofs that the extracted checker accepts. *)
let rec prove_by state claim proofs reason = match proofs () with
  | Seq.Nil -> rejected "%s" reason
  | Seq.Cons (proof, others) ->
    match Proved.step state.parts state.accepted claim proof with
    | Some accepted -> state.accepted <- accepted; state.log <- (claim, proof) :: state.log
    | None -> prove_by state claim others reason

(* On boxes: what --coq does not write; proofs by parts hold guesses of floating point as functions. *)
let rec prove_unwritten_by state claim proofs reason = match proofs () with
  | Seq.Nil -> rejected "%s" (reason ())
  | Seq.Cons (proof, others) ->
    match Proved.step state.parts state.accepted claim proof with
    | Some accepted -> state.accepted <- accepted; state.unwritten <- state.unwritten + 1
    | None -> prove_unwritten_by state claim others reason
let prove_unwritten state claim proof = prove_unwritten_by state claim (Seq.return proof)

let prove state claim proof reason = prove_by state claim (Seq.return proof) reason

(* The chain of matrices that a bound is about, and what is known of the functions between them. *)
let stages state claim =
  let joined parts moves scale matrices =
    List.fold_left (fun (hidden, last) part -> let w, v = matrices part in Proved.set_stages hidden last w v)
      ([], Proved.selector moves scale) parts in
  match claim with
  | Proved.Norm_at_most (p, k, _) -> [], ([], Proved.matrix_at state.parts p k)
  | Slope_at_most (f, moves, scale, _) ->
    let parts = List.map Proved.regrouped (Proved.parts_of state.parts f) in
    List.concat_map (Proved.relations_by Proved.divided_ranges) parts, joined parts moves scale Proved.matrices
  | Slope_in_box (f, moves, scale, box, _) ->
    List.concat (Proved.local_relations state.parts f box),
    joined (Proved.parts_of state.parts f) moves scale Proved.undivided_matrices
  | _ -> assert false

let not_checked state what = state.not_checked <- what :: state.not_checked

let at_most = Proved.at_most
let times = Proved.mul0
let plus = Proved.add0

let check_status where json =
  let status = text where (find where "status" json) in
  require (status = "finished" || status = "interrupted") "%s: unknown status" where

(* Proofs of a claim by a matrix inequality: one, or where the certificate leaves out the factor, those to try.
   `neurons`: hidden ones of the chain. *)
let inequality state claim where ~neurons ~upper json =
  let here = where ^ ".proof" in
  require_keys here [ "rho"; "t"; "factor" ] json;
  let rho = Exact.of_float (Exact.hex_float where (find here "rho" json)) in
  let t = List.map Exact.of_float (Exact.hex_floats where (find here "t" json)) in
  require (List.length t = neurons) "%s: needs one multiplier t per hidden neuron" where;
  require (Proved.is_positive rho && List.for_all Proved.is_nonnegative t)
      "%s: rho is not positive, or a t negative" where;
  require (at_most rho (times upper upper)) "%s: claims less than sqrt(rho)" where;
  let by factor = match claim with
    | Proved.Slope_in_box _ -> Proved.By_local_inequality (rho, t, factor)
    | _ -> By_inequality (rho, t, factor) in
  match find here "factor" json with
  | Null ->
    let ranges, (hidden, last) = stages state claim in
    Seq.map by (Proposal.factors (Proved.matrix_inequality ranges hidden last rho t))
  | factor -> Seq.return (by (Exact.factor (where ^ ".factor") factor))

let no_factor where = where ^ ": the factor does not show that the matrix inequality holds"

let check_layer state entry part k (layer : Weights.layer) =
  let where = Printf.sprintf "layer %s %s" part layer.name in
  require_keys where [ "network"; "name"; "spectral_norm"; "spectral_norm_hex"; "proof" ] entry;
  require (find where "network" entry = Text part && find where "name" entry = Text layer.name)
      "%s is not where it is expected" where;
  let end_ i = Exact.number where (element where i (find where "spectral_norm" entry))
      (element where i (find where "spectral_norm_hex" entry)) in
  let lower = Exact.of_float (end_ 0) and upper = Exact.of_float (end_ 1) in
  let proof = find where "proof" entry in
  require_keys (where ^ ".proof") [ "lower_vector"; "upper" ] proof;
  let vector = List.map Exact.of_float (Exact.hex_floats where (find where "lower_vector" proof)) in
  require (List.length vector = Weights.inputs layer && List.exists (fun x -> x <> Exact.zero) vector)
      "%s: unusable lower_vector" where;
  let p = Functions.index state.net part in
  prove state (Norm_at_least (p, k, lower)) (By_vector vector) (where ^ ": claims more than |W v| / |v|");
  let at_most = Proved.Norm_at_most (p, k, upper) in
  prove_by state at_most (inequality state at_most where ~neurons:0 ~upper (find where "upper" proof))
    (no_factor where);
  let product = Option.value ~default:Exact.one (Hashtbl.find_opt state.norms part) in
  Hashtbl.replace state.norms part (times product upper);
  state.spectral_norms <- state.spectral_norms + 1

(* Bounds *)

let most_neighbours = 1_000_000

let counts where json = List.map (fun (kind, n) -> kind, whole where n) (members where json)

let neighbours_of state where bound =
  if not (has "neighbours" bound) then [] else begin
    let counts = List.sort compare (counts where (find where "neighbours" bound)) in
    let names = Functions.networks_of (text where (find where "function" bound)) in
    require (List.length names = 2 && find where "domain" bound = Text "box")
        "%s: neighbours may be given only for a set function on a box" where;
    List.iter (fun (kind, n) ->
        require (kind <> "ground" && List.mem_assoc ("phi:" ^ kind) state.net.parts && 1 <= n && n <= most_neighbours)
          "%s: impossible neighbours" where) counts;
    let moves kind = List.hd names = "phi:" ^ kind in
    require (counts <> [] && (moves "ground" || List.exists (fun (kind, _) -> moves kind) counts))
      "%s: the neighbour that moves is not among those listed" where;
    counts
  end

let function_of state = function
  | [ part ] -> Proved.Alone (Functions.index state.net part)
  | [ phi; rho ] -> Proved.Set_of (Functions.index state.net phi, Functions.index state.net rho)
  | _ -> assert false

(* Multipliers of the neurons that an activation follows, where the last layer of phi and the first of rho are one: two
   for each group of a layer that is sorted. *)
let hidden_neurons state names =
  let hidden part =
    let w = Functions.weights state.net part in
    List.fold_left2 (fun n layer a -> n + Activation.multipliers a (Weights.outputs layer)) 0
      (List.filteri (fun k _ -> k < List.length (Weights.between w)) w.layers) (Weights.between w) in
  List.fold_left (fun n part -> n + hidden part) 0 names

let meaning state where bound names scale =
  let f = text where (find where "function" bound) and block = text where (find where "block" bound) in
  let in_box = find where "domain" bound = Text "box" &&
      (match find where "box" state.json with Object _ -> true | _ -> false) in
  [ "domain", (if in_box then "box" else "global");
    "law", (if List.length names = 2 then "one_neighbour" else "none");
    "norm", (if scale = [] then "l2" else "weighted_l2");
    "unit", Functions.unit state.net f block ]

let bound_keys = [ "function"; "domain"; "block"; "law"; "norm"; "scale"; "unit"; "upper"; "upper_hex"; "upper_method";
    "lower";
                   "lower_hex"; "lower_witness"; "proof"; "status" ]

let too_little where = where ^ ": claims less than the product of the norms"

let check_product state where names claim ~largest upper =
  let total = List.fold_left (fun total name -> match Hashtbl.find_opt state.norms name with
      | Some norm ->
        List.fold_left (fun total activation -> times total (Proved.steepest activation)) (times total norm)
          (Weights.between (Functions.weights state.net name))
      | None -> rejected "%s: there is no network %s" where (shown name)) largest names in
  require (at_most total upper) "%s" (too_little where);
  prove state claim Proved.By_product (too_little where)

(* The box of a part; the theorems apply the clamp themselves. *)
let box_of state where part =
  List.map (fun (low, high) -> Exact.of_float low, Exact.of_float high) (Witness.box where state.json part)

(* By parts of boxes: the claim is one of the box. *)
let check_parts state where bound names ~func ~moves ~scale ~exact_scale ~neighbours ~upper =
  if has "others" (find where "proof" bound) then begin
    let claim, proof, reason =
      Coupled.read state.net state.json bound ~where ~names ~moves ~scale ~neighbours ~upper in
    prove_unwritten state claim (proof ()) reason;
    Among
  end else begin
    let domain, proof, reason = Box_parts.read state.net state.json bound ~where ~names ~moves ~scale ~upper in
    let claim, source = match domain with
      | Box_parts.Box box -> Proved.Slope_in_box (func, moves, exact_scale, box, upper), In_box
      | Everywhere -> Slope_at_most (func, moves, exact_scale, upper), By_parts in
    prove_unwritten state claim (proof ()) reason;
    source
  end

(* What is not stated of functions with other activations than ReLU. *)
let check_activations state where bound names =
  let activations = List.concat_map (fun name -> Weights.between (Functions.weights state.net name)) names in
  List.iter (fun activation ->
      if activation <> Proved.Relu then begin
        let of_ = " of a network with " ^ Activation.words activation in
        let by method_ = find where "upper_method" bound = Text method_ in
        require (not (Activation.sorts activation) || List.exists by [ "product"; "local_product"; "sdp" ])
          "%s: a bound from slopes of single numbers%s" where of_
      end) activations

(* From the slopes that activations have on the box. *)
let local_methods = [ Text "local_sdp"; Text "local_product" ]
let check_local state where bound names ~func ~moves ~exact_scale ~upper =
  require (find where "domain" bound = Text "box" && not (Functions.starts_with "rho:" (List.hd names)))
    "%s: slopes on a box of a bound without one" where;
  let is_product = find where "upper_method" bound = Text "local_product" and proof = find where "proof" bound in
  require (not is_product || proof = Null) "%s: unknown upper_method" where;
  let claim = Proved.Slope_in_box (func, moves, exact_scale, box_of state where (List.hd names), upper) in
  if is_product then prove_unwritten state claim By_local_product (fun () -> too_little where)
  else begin
    let proofs = inequality state claim where ~neurons:(hidden_neurons state names) ~upper proof in
    prove_unwritten_by state claim proofs (fun () -> no_factor where)
  end;
  In_box

(* Part by part of a box, from the slopes that activations have in each. *)
let check_slope_tree state where bound names ~func ~moves ~exact_scale ~upper =
  let json = find where "proof" bound and here = where ^ ".proof" and moved = List.hd names in
  require_keys here [ "rho"; "form"; "tree"; "multipliers" ] json;
  require (find where "domain" bound = Text "box" && find here "form" json = Null)
    "%s: a bound by parts for other activations than ReLU is for a box, without a form" where;
  require (not (Functions.starts_with "rho:" moved)) "%s: rho has no box" where;
  let rho = Exact.of_float (Box_parts.rho_of where json ~upper) and neurons = hidden_neurons state names in
  let multipliers = Array.of_list (List.map (Box_parts.hex_words where) (list where (find here "multipliers" json))) in
  let reader = Box_parts.reader where (text where (find here "tree" json)) in
  let rec prove_part pending box low high =
    let claim = Proved.Slope_in_box (func, moves, exact_scale, box, upper) in
    let word = Box_parts.next reader in
    let at = reader.at - 1 in
    let fails reason = Box_parts.fails reader at reason in
    match word with
    | Split k ->
      let middle = Box_parts.middle_of reader at k low high ~pending ~boxes:1 in
      let cut is_upper = Proved.cut k (Exact.of_float middle) is_upper box in
      prove_part (pending + 1) (cut false) low (Box_parts.with_middle high k middle);
      prove_part pending (cut true) (Box_parts.with_middle low k middle) high;
      prove_unwritten state claim (By_halves (k, Exact.of_float middle)) (fun () -> where ^ ": the halves do not fit")
    | Multipliers k ->
      if k >= Array.length multipliers then fails "there are no such multipliers";
      let t = multipliers.(k) in
      if not (List.length t = neurons && List.for_all (fun x -> x >= 0.) t) then
        fails "multipliers are not one nonnegative number per hidden neuron";
      let t = List.map Exact.of_float t in
      let ranges, (hidden, last) = stages state claim in
      let factors = Proposal.factors (Proved.matrix_inequality ranges hidden last rho t) in
      prove_unwritten_by state claim (Seq.map (fun factor -> Proved.By_local_inequality (rho, t, factor)) factors)
        (fun () -> Printf.sprintf "%s: word %d of the tree: its multipliers do not show the bound there" where (at + 1))
    | _ -> fails "neither a split nor a leaf" in
  let box, low, high = Box_parts.box_of state.net state.json moved where in
  prove_part 0 box low high;
  Box_parts.ends reader;
  In_box

(* The proof of a bound of function `f`, and of the lower one where there is a witness. *)
let check_bound_by_theorems state bound names f block where ~scale ~neighbours ~upper =
  let moves = Functions.moves state.net f block and func = function_of state names in
  let exact_scale = List.map Exact.of_float scale in
  let claim = Proved.Slope_at_most (func, moves, exact_scale, upper) in
  let source = match find where "upper_method" bound with
    | Text ("sdp" | "eclipse_fast") ->
      let neurons = hidden_neurons state names in
      let proofs = inequality state claim where ~neurons ~upper (find where "proof" bound) in
      prove_by state claim proofs (no_factor where); Proved_here
    | method_ when List.mem method_ local_methods ->
      check_local state where bound names ~func ~moves ~exact_scale ~upper
    | Text "branch" when not (List.for_all (Functions.is_relu state.net) names) ->
      check_slope_tree state where bound names ~func ~moves ~exact_scale ~upper
    | Text "branch" -> check_parts state where bound names ~func ~moves ~scale ~exact_scale ~neighbours ~upper
    | Text "product" when find where "proof" bound = Null ->
      let largest = match scale with [] -> 1. | first :: rest -> List.fold_left Float.max first rest in
      check_product state where names claim ~largest:(Exact.of_float largest) upper; Proved_here
    | _ -> rejected "%s: unknown upper_method" where in
  if scale = [] then begin
    Hashtbl.replace state.uppers (f, block, neighbours) (upper, source);
    if List.mem (find where "upper_method" bound) (Text "branch" :: local_methods)
       && find where "domain" bound = Text "box" && neighbours = [] then
      Hashtbl.replace state.in_box (f, block) ()
  end;
  state.upper_bounds <- state.upper_bounds + 1;
  match find where "lower_witness" bound with
  | Null -> require (find where "lower" bound = Null && find where "lower_hex" bound = Null)
      "%s: lower has no witness" where
  | witness ->
    let lower = Exact.of_float (Exact.number (where ^ " lower") (find where "lower" bound)
        (find where "lower_hex" bound)) in
    let in_box = find where "domain" bound = Text "box" in
    let proof, silent =
      Witness.read state.net state.json (where ^ ": lower_witness") names ~in_box ~neighbours ~moves witness in
    prove state (Slope_at_least (silent, func, moves, exact_scale, lower)) proof
        (where ^ ": lower_witness: claims more than the slope between x and y");
    state.lower_bounds <- state.lower_bounds + 1

let check_bound state bound =
  require_keys "bound" (bound_keys @ if has "neighbours" bound then [ "neighbours" ] else []) bound;
  let f = text "bound" (find "bound" "function" bound) and block = text "bound" (find "bound" "block" bound) in
  let where = Printf.sprintf "bound %s %s" (shown f) (shown block) in
  let names = Functions.networks_of f in
  let scale = Exact.hex_floats where (find where "scale" bound) in
  require (List.for_all (fun s -> s > 0.) scale) "%s: scale is not positive" where;
  List.iter (fun (key, text) -> require (find where key bound = Text text) "%s: %s is not %s" where key text)
      (meaning state where bound names scale);
  require (scale = [] || List.length scale = Functions.inputs state.net (List.hd names))
      "%s: scale has another size" where;
  let neighbours = neighbours_of state where bound in
  let upper = Exact.of_float (Exact.number (where ^ " upper") (find where "upper" bound)
      (find where "upper_hex" bound)) in
  check_status where bound;
  check_activations state where bound names;
  check_bound_by_theorems state bound names f block where ~scale ~neighbours ~upper

(* Laws *)

let check_law state law =
  require_keys "law" [ "rho"; "neighbours"; "domain"; "block"; "law"; "status"; "upper"; "upper_hex" ] law;
  let rho = text "law" (find "law" "rho" law) and block = text "law" (find "law" "block" law) in
  let where = Printf.sprintf "law of %s %s" (shown rho) (shown block) in
  check_status where law;
  let upper = Exact.of_float (Exact.number (where ^ " upper") (find where "upper" law) (find where "upper_hex" law)) in
  let neighbours = List.sort compare (counts where (find where "neighbours" law)) in
  require (not (List.mem_assoc "ground" neighbours)) "%s: the ground is not a neighbour" where;
  let terms = List.sort compare (neighbours @ if Functions.has_ground state.net then [ "ground", 1 ] else []) in
  let domain = text where (find where "domain" law) in
  require (domain = "box" || domain = "global") "%s: unknown domain" where;
  let bound_of (kind, count) =
    require (1 <= count && count <= most_neighbours) "%s: impossible number of neighbours" where;
    let f = Printf.sprintf "set:%s:%s" kind rho in
    let any, source = match Hashtbl.find_opt state.uppers (f, block, []) with
      | Some found -> found | None -> rejected "%s: rests on a bound of %s that is missing" where (shown f) in
    require (domain = "box" || not (Hashtbl.mem state.in_box (f, block)))
      "%s: rests on a bound that holds on a box only" where;
    match Hashtbl.find_opt state.uppers (f, block, neighbours) with
    | Some (fewer, fewer_source) when domain = "box" && neighbours <> [] && at_most fewer any ->
      f, count, fewer, (if Z.equal (fst fewer) (fst any) && Z.equal (snd fewer) (snd any) then source else fewer_source)
    | _ -> f, count, any, source in
  let bounds = List.map bound_of terms in
  require (List.mem block [ "all"; "position"; "velocity" ]) "%s: no law for this block" where;
  let name = text where (find where "law" law) in
  let stacked = name = "all_stacked" in
  require (stacked || name = "all_max" || name = "own_state") "%s: unknown law" where;
  let total = List.fold_left (fun sum (_, n, k, _) ->
      plus sum (times (Z.of_int n, Z.zero) (if stacked then times k k else k))) Exact.zero bounds in
  let reason = where ^ ": claims less than the law gives" in
  require (at_most total (if stacked then times upper upper else upper)) "%s" reason;
  let part f = List.hd (Functions.networks_of f) in
  let has_box (f, _, _, _) = match state.json with
    | Object members -> (match List.assoc_opt "box" members with Some box -> has (part f) box | None -> false)
    | _ -> false in
  let is_written = List.for_all (fun (_, _, _, source) -> source = Proved_here) bounds in
  let everywhere = List.for_all (fun (_, _, _, source) -> source = Proved_here || source = By_parts) bounds in
  if not (everywhere || List.for_all has_box bounds) then
    not_checked state (Printf.sprintf "%s: rests on a bound that is not checked" where)
  else begin
    let kind (f, n, _, _) = (Functions.index state.net (part f), Functions.moves state.net f block), Z.of_int n in
    let in_box ((f, _, _, _) as bound) = kind bound, box_of state where (part f) in
    let rho = Functions.index state.net ("rho:" ^ rho) in
    let law = Proved.Law (stacked, List.map kind bounds, rho, upper) in
    if List.exists (fun (_, _, _, source) -> source = Among) bounds then begin
      (* In the order of the others in claims of bounds. *)
      let grounds, others = List.partition (fun (f, _, _, _) -> part f = "phi:ground") bounds in
      let least (f, _, _, _) = if part f = "phi:ground" then Z.one else Z.zero in
      let kinds = List.map (fun bound -> in_box bound, least bound) (others @ grounds) in
      prove_unwritten state (Law_among (stacked, kinds, rho, upper)) By_triangle (fun () -> reason)
    end
    else if is_written then prove state law By_triangle reason
    else if everywhere then prove_unwritten state law By_triangle (fun () -> reason)
    else
      prove_unwritten state (Law_in_box (stacked, List.map in_box bounds, rho, upper)) By_triangle (fun () -> reason);
    state.upper_bounds <- state.upper_bounds + 1
  end
