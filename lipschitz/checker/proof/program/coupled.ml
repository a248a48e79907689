(* Proofs by parts of a box among a given number of neighbours: phi, what the others add, and rho, as one network. The
   theorem needs no forms, only the multipliers of rho's neurons that come with them; forms that do not hold are refused
   all the same, as by the other checkers. *)

open Refusal
open Json
open Box_parts

(* rho's first layer behind phi's last one, with these numbers added, in floating point. *)
let joined (phi : Weights.layer) (rho : Weights.layer) added =
  let times row = Array.init (Weights.inputs phi) (fun j ->
      let sum = ref 0. in Array.iteri (fun k v -> sum := !sum +. v *. phi.weights.(k).(j)) row; !sum) in
  let bias i row =
    let sum = ref (rho.biases.(i) +. added.(i)) in
    Array.iteri (fun k v -> sum := !sum +. v *. phi.biases.(k)) row; !sum in
  { rho with weights = Array.map times rho.weights; biases = Array.mapi bias rho.weights }

(* A decision of a neuron of phi. *)
let decision reader ~layers ~low ~high (neuron, is_on, corner) =
  match place neuron 0 (sizes_of layers) with
  | Some (layer, neuron) when Array.length low <= most_inputs_of_a_corner ->
    layer, { Proved.neuron; is_on; lower_slopes = slopes_at layers layer (point corner low high) }
  | _ -> fails reader (reader.at - 1) "a neuron is not decided by its slopes"

(* What shows the range of a term. *)
let range_of where (phi : Weights.t) low high text =
  let reader = reader where text in
  let layers = hidden phi in
  let count = List.length layers in
  let rec tree pending low high found =
    let word = next reader in
    let here = reader.at - 1 in
    match word with
    | Decided (neuron, is_on, corner) ->
      tree pending low high (decision reader ~layers ~low ~high (neuron, is_on, corner) :: found)
    | Multipliers 0 -> Proved.Range_leaf (decided found count)
    | Multipliers _ -> fails reader here "a leaf of a range has no multipliers"
    | Split k ->
      let middle = middle_of reader here k low high ~pending ~boxes:1 in
      let lower = tree (pending + 1) low (with_middle high k middle) [] in
      let upper = tree pending (with_middle low k middle) high [] in
      Range_halves (decided found count, k, Exact.of_float middle, lower, upper)
    | Form _ | Of_rho -> fails reader here "a range has no forms" in
  let result = tree 0 low high [] in
  ends reader;
  result

(* The terms that do not move, with the proofs of their ranges. *)
let others_of (net : Network.t) certificate ~where ~neighbours moved rho json =
  let counts = List.filter_map (fun (kind, n) ->
      let n = if moved = "phi:" ^ kind then n - 1 else n in
      if n > 0 then Some (kind, 0, n) else None) neighbours in
  let counts = counts @ if moved <> "phi:ground" && Functions.has_ground net then [ "ground", 1, 1 ] else [] in
  require (List.length (members where json) = List.length counts)
    "%s: others does not list the kinds of the other neighbours" where;
  let rows = Weights.outputs (Weights.first_layer (Functions.weights net rho)) in
  List.map (fun (kind, fewest, most) ->
      let part = "phi:" ^ kind in
      let here = where ^ "." ^ part in
      let range = find where part json in
      require_keys here [ "tree"; "least"; "most" ] range;
      let list key = List.map Exact.of_float (Exact.hex_floats here (find here key range)) in
      let least = list "least" and greatest = list "most" in
      require (List.length least = rows && List.length greatest = rows) "%s: the range belongs to something else" here;
      let box, low, high = box_of net certificate part here in
      let tree = range_of here (Functions.weights net part) low high (text here (find here "tree" range)) in
      { Proved.phi = Functions.index net part; inputs_in = box; fewest = Z.of_int fewest; most = Z.of_int most },
      (List.combine least greatest, tree)) counts

let rec split numbers = function
  | [] -> []
  | size :: sizes ->
    List.filteri (fun k _ -> k < size) numbers :: split (List.filteri (fun k _ -> k >= size) numbers) sizes

(* |drho|^2 <= dv' q dv by multipliers of rho's neurons. *)
type form = { q : Proved.matrixD; t : Proved.dyadic list }
(* What is stated of forms in a part, with the numbers of the words: those that are said to hold there; of a leaf, the
   one in force, and the multipliers of phi's neurons and the conflicts that show the bound with it. *)
type stated = {
  said : (int * form) list;
  then_ : leaf_or_halves;
}
and leaf_or_halves =
  | Leaf_with of int * form * Proved.conflict list * Proved.dyadic list
  | Halves of int * Proved.dyadic * stated * stated

(* The tree of the moved term's box, what it states of forms, and the number of the word of each leaf. *)
let tree_of ~where ~(phi : Weights.t) ~(rho : Weights.t) ~added ~multipliers ~forms low high text =
  let reader = reader where text in
  let first = hidden phi and rest = hidden rho in
  let before = List.length first in
  let layers = first @ joined (Weights.last_layer phi) (List.hd rest) added :: List.tl rest in
  let all_sizes = sizes_of phi.layers @ sizes_of rest in
  let count = List.length layers in
  let passing = List.init (Weights.outputs (List.hd rest)) (fun _ -> Exact.zero) in
  let leaves = ref [] in
  let decide low high here (neuron, is_on, corner) =
    match place neuron 0 all_sizes with
    | Some (layer, _) when layer = before || Array.length low > most_inputs_of_a_corner ->
      fails reader here "a neuron of rho is not decided by its slopes"
    | None -> fails reader here "there is no such neuron"
    | Some (layer, neuron) ->
      let layer = if layer > before then layer - 1 else layer in
      layer, { Proved.neuron; is_on; lower_slopes = slopes_at layers layer (point corner low high) } in
  (* `waiting`: decisions that no word has used yet. Those of phi are used by the first word that is not a decision. *)
  let rec tree pending low high form said ~is_first found waiting =
    let word = next reader in
    let here = reader.at - 1 in
    let looked_at = if is_first then List.filter (fun (layer, _) -> layer < before) waiting else [] in
    let of_rho = List.filter (fun (layer, _) -> layer >= before) waiting in
    let nothing_waits () =
      if of_rho <> [] || (not is_first && waiting <> []) then
        fails reader here "a neuron is decided, but the decision is not used" in
    match word with
    | Decided (neuron, is_on, corner) ->
      tree pending low high form said ~is_first found (decide low high here (neuron, is_on, corner) :: waiting)
    | Of_rho -> tree pending low high form said ~is_first:false (of_rho @ looked_at @ found) []
    | Form k ->
      if k >= Array.length forms then fails reader here "there is no such form";
      tree pending low high (Some forms.(k)) ((here + 1, forms.(k)) :: said) ~is_first:false
        (of_rho @ looked_at @ found) []
    | Multipliers k ->
      nothing_waits ();
      if k >= Array.length multipliers then fails reader here "there are no such multipliers";
      (match form with
       | None -> fails reader here "there is no form yet"
       | Some form ->
         leaves := (here + 1) :: !leaves;
         let conflicts, t = multipliers.(k) in
         let all = List.concat_map (fun some -> some @ passing) (split t (sizes_of first)) @ form.t in
         Proved.Leaf (decided (looked_at @ found) count, conflicts, all),
         { said = List.rev said; then_ = Leaf_with (here + 1, form, conflicts, t) })
    | Split k ->
      nothing_waits ();
      let middle = middle_of reader here k low high ~pending ~boxes:1 in
      let lower, below = tree (pending + 1) low (with_middle high k middle) form [] ~is_first:true [] [] in
      let upper, above = tree pending (with_middle low k middle) high form [] ~is_first:true [] [] in
      let middle = Exact.of_float middle in
      Proved.Halve (decided (looked_at @ found) count, k, middle, lower, upper),
      { said = List.rev said; then_ = Halves (k, middle, below, above) } in
  let result, stated = tree 0 low high None [] ~is_first:true [] [] in
  ends reader;
  result, stated, Array.of_list (List.rev !leaves)

(* Whether forms hold where they are said to, and leaves with them: as the other checkers look at a part. *)
let check_forms ~where (f : Proved.part) (g : Proved.part) ~least ~moves ~scale ~square box tree stated =
  let whole = Proved.coupled f g least in
  let layers_of_phi = List.length f.hidden in
  let lines_of_phi lines =
    List.map2 (fun (w, _) l -> List.filteri (fun k _ -> k < List.length w) l) f.hidden
      (List.filteri (fun k _ -> k < layers_of_phi) lines) in
  let lines_of_rho lines = List.filteri (fun k _ -> k >= layers_of_phi) lines in
  let no_hints = { Proved.slope_between; rounded_up; factor_number = fun _ _ -> None } in
  let require_shown word matrix what =
    require (Proved.shown_by (next_factor (new_guesses ())) Proved.most_factors 0 matrix)
      "%s: word %d of the tree: its multipliers do not show the %s there" where word what in
  let n = Proved.inputs_of g in
  let units = List.init n Proved.unit_form in
  let holds lines (word, form) =
    let (pairs, z), _ = Proved.chain_pairs g.hidden (lines_of_rho lines)
        (split form.t (List.map (fun (w, _) -> List.length w) g.hidden)) units n in
    require_shown word (Proved.quadratic (Proved.form_pairs Exact.one form.q units units @ pairs
      @ Proved.minus_squares (Proved.times_rows (fst g.outer) z))) "form" in
  let rec walk box around tree stated =
    let decided = match tree with Proved.Leaf (ds, _, _) | Halve (ds, _, _, _, _) -> ds in
    match Proved.bounds no_hints box [] whole.hidden around decided with
    | None -> ()  (* the proof says so *)
    | Some lines ->
      List.iter (holds lines) stated.said;
      match tree, stated.then_ with
      | Leaf _, Leaf_with (word, form, conflicts, t) ->
        let shown = List.filter (Proved.is_shown whole.hidden lines box) conflicts in
        require_shown word (Proved.part_inequality f.hidden f.outer (Some form.q) moves scale square
          (lines_of_phi lines) shown t) "bound"
      | Halve (_, _, _, lower, upper), Halves (k, middle, below, above) ->
        walk (Proved.cut k middle false box) lines lower below;
        walk (Proved.cut k middle true box) lines upper above
      | _ -> assert false in
  walk box [] tree stated

let forms_of where (rho : Weights.t) json =
  let inputs = Weights.inputs (Weights.first_layer rho) in
  let neurons = List.fold_left (+) 0 (sizes_of (hidden rho)) in
  let of_form json =
    require_keys (where ^ ".forms") [ "q"; "t" ] json;
    let q = hex_words where (find where "q" json) and t = hex_words where (find where "t" json) in
    require (List.length q = inputs * (inputs + 1) / 2 && List.length t = neurons)
      "%s: a form has another size" where;
    require (List.for_all (fun x -> Float.abs x <= 0x1p400) q && List.for_all (fun x -> 0. <= x && x <= 0x1p400) t)
      "%s: a form is out of range, or a t of it negative" where;
    let rec rows k q = if k > inputs then [] else
        List.filteri (fun i _ -> i < k) q :: rows (k + 1) (List.filteri (fun i _ -> i >= k) q) in
    { q = rows 1 (List.map Exact.of_float q); t = List.map Exact.of_float t } in
  Array.of_list (List.map of_form (list where json))

(* The claim of `bound`'s proof, what proves it, and the reason where that does not. *)
let read (net : Network.t) certificate bound ~where ~names ~moves ~scale ~neighbours ~upper =
  let json = find where "proof" bound in
  require_keys (where ^ ".proof") ([ "rho"; "others"; "forms"; "tree"; "multipliers" ]
    @ if has "conflicts" json then [ "conflicts" ] else []) json;
  require (neighbours <> []) "%s: a bound for any number of neighbours needs a form" where;
  let moved = List.hd names and name = List.nth names 1 in
  let phi = Functions.weights net moved and rho = Functions.weights net name in
  require (List.length phi.layers > 1) "%s: %s has no hidden layer" where moved;
  require (List.length rho.layers > 1) "%s: %s has no hidden layer" where name;
  let square = rho_of where json ~upper in
  let here = where ^ ".others" in
  let others = others_of net certificate ~where:here ~neighbours moved name (find where "others" json) in
  let box, low, high = box_of net certificate moved where in
  let multipliers = multipliers_of where json (sizes_of (hidden phi)) in
  let forms = forms_of where rho (find where "forms" json) in
  check_range where square ~moves ~scale;
  let terms = List.map fst others and ranges = List.map snd others in
  let rows = Weights.outputs (Weights.first_layer rho) in
  let sums = match Proved.ends_of_terms rows terms (List.map fst ranges) with
    | Some ends -> ends | None -> rejected "%s: the range belongs to something else" here in
  let middle (low, high) = (Proposal.to_float low +. Proposal.to_float high) /. 2. in
  let added = Array.of_list (List.map middle sums) in
  let tree, stated, leaves =
    tree_of ~where ~phi ~rho ~added ~multipliers ~forms low high (text where (find where "tree" json)) in
  let hints, reason = hints_of where leaves in
  let rho_index = Functions.index net name in
  let states_range (term, range) =
    require (Proved.check_term_range (Functions.parts net) rho_index hints term range)
      "%s.%s: the range is larger there" here (fst (List.nth net.parts term.Proved.phi)) in
  List.iter states_range others;
  let parts = Functions.parts net in
  let f = List.nth parts (Functions.index net moved) and g = List.nth parts rho_index in
  let widths = List.map (fun (low, high) -> Exact.zero, Proved.add0 high (Proved.neg low)) sums in
  check_forms ~where f g ~least:(List.map fst sums) ~moves ~scale:(List.map Exact.of_float scale)
    ~square:(Exact.of_float square) (Proved.clamp_ends f.clamp box @ widths) tree stated;
  let claim = Proved.Slope_among
      (Functions.index net moved, rho_index, moves, List.map Exact.of_float scale, box, terms, upper) in
  claim, (fun () -> Proved.By_parts_among (Exact.of_float square, hints, ranges, tree)), reason
