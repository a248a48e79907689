(** The LipSDP argument where the slopes of each neuron lie in a range [a, b] of its own, or where groups of numbers
  keep
  their sum and come no further apart: what a layer adds to the quadratic form has the square of what enters it, so that
  the inputs stay in the matrix. *)
From Coq Require Import List Reals Lra Lia Psatz.
From Swarmcert Require Import Algebra Activations Form Network.
Import ListNotations.

Section Operations.
Context {T : Type} (zero : T) (add mul : T -> T -> T).
(** Upper rows of m diag(s) m'. *)
Fixpoint weighted_gram (s : list T) (m : list (list T)) : list (list T) :=
  match m with [] => [] | row :: m' => map (dot zero add mul (times mul s row)) m :: weighted_gram s m' end.
(** The ranges of slopes, the multipliers and the stage of each hidden layer. *)
Definition bent_layer := (list (T * T) * list T * list (list T))%type.
Definition ranges_of (k : bent_layer) := fst (fst k).
Definition multipliers_of (k : bent_layer) := snd (fst k).
Definition sums (r : list (T * T)) : list T := map (fun i => add (fst i) (snd i)) r.
Definition products (r : list (T * T)) : list T := map (fun i => mul (fst i) (snd i)) r.
(** A block m' diag(t a b) m for each of them, where what enters it stands; n numbers enter the first. *)
Fixpoint bends (n : nat) (hidden : list bent_layer) : list (list T) :=
  match hidden with
  | [] => []
  | (r, t, m) :: hidden' =>
      weighted_gram (times mul t (products r)) (columns zero n m) ++ bends (length t) hidden'
  end.
(** The multipliers, and diag(a + b) m. *)
Definition weighted (hidden : list bent_layer) :=
  map (fun k => (multipliers_of k, scale_rows mul (sums (ranges_of k)) (snd k))) hidden.
(** In (dx, dz_1, dz_2, ...), with t = rho / 2 for each input. *)
Definition bent_lmi (two minus_one : T) (t : list T) (hidden : list bent_layer) (last : list (list T)) :=
  sum add (band zero add mul two minus_one t (weighted hidden) last) (scale_all mul two (bends (length t) hidden)).
(** Of a layer m of n groups of k numbers, which takes `inputs`: the sum of what enters a group less that of what leaves
    it; `before` numbers leave groups in front. *)
Definition fitted (n : nat) (u : list T) : list T := firstn n (plus add u (repeat zero n)).
Fixpoint sum_rows (minus_one : T) (inputs before n k : nat) (m : list (list T)) : list (list T) :=
  match n with
  | O => []
  | S n' =>
      (fitted inputs (fold_right (plus add) [] (firstn k m)) ++ repeat zero before ++ repeat minus_one k)
      :: sum_rows minus_one inputs (before + k) n' k (skipn k m)
  end.
(** Weights, rows and the number of numbers of each hidden layer. *)
Definition pin := (list T * list (list T) * nat)%type.
(** Weighted squares of these rows, which vanish. *)
Fixpoint pins (n : nat) (ps : list pin) : list (list T) :=
  match ps with
  | [] => []
  | (s, rows, width) :: ps' =>
      sum add (weighted_gram s (columns zero (n + width) rows)) (repeat [] n ++ pins width ps')
  end.
End Operations.

Section Morphism.
Context {S T : Type} (zero : S) (add mul : S -> S -> S) (zero' : T) (add' mul' : T -> T -> T) (f : S -> T)
  (f_zero : f zero = zero') (f_add : forall a b, f (add a b) = add' (f a) (f b))
  (f_mul : forall a b, f (mul a b) = mul' (f a) (f b)).
Notation F := (map f).
Notation FF := (map (map f)).
Lemma f_times u v : F (times mul u v) = times mul' (F u) (F v).
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; auto. now rewrite f_mul, IH. Qed.
Lemma f_weighted_gram s m : FF (weighted_gram zero add mul s m) = weighted_gram zero' add' mul' (F s) (FF m).
Proof.
  induction m as [|r m IH]; simpl; auto.
  rewrite IH, (f_dot zero add mul zero' add' mul' f f_zero f_add f_mul), f_times, !map_map. do 2 f_equal.
  apply map_ext. intros. now rewrite (f_dot zero add mul zero' add' mul' f f_zero f_add f_mul), f_times.
Qed.
Definition image_of_ranges := map (fun i : S * S => (f (fst i), f (snd i))).
Definition images := map (fun k : bent_layer => (image_of_ranges (ranges_of k), F (multipliers_of k), FF (snd k))).
Lemma f_sums r : F (sums add r) = sums add' (image_of_ranges r).
Proof. unfold sums, image_of_ranges. rewrite !map_map. apply map_ext. intros. apply f_add. Qed.
Lemma f_products r : F (products mul r) = products mul' (image_of_ranges r).
Proof. unfold products, image_of_ranges. rewrite !map_map. apply map_ext. intros. apply f_mul. Qed.
Lemma f_bends n hidden : FF (bends zero add mul n hidden) = bends zero' add' mul' n (images hidden).
Proof.
  revert n. induction hidden as [|[[r t] m] hidden IH]; intros n; simpl; auto. unfold ranges_of, multipliers_of. simpl.
  rewrite map_app, f_weighted_gram, (f_columns zero zero' f f_zero), f_times, f_products, IH, map_length. auto.
Qed.
Lemma f_weighted hidden : pairs f (weighted add mul hidden) = weighted add' mul' (images hidden).
Proof.
  unfold pairs, weighted, images, multipliers_of, ranges_of. rewrite !map_map. apply map_ext. intros [[r t] m]. simpl.
  now rewrite (f_scale_rows mul mul' f f_mul), f_sums.
Qed.
Lemma f_bent_lmi a b t hidden last : FF (bent_lmi zero add mul a b t hidden last) =
  bent_lmi zero' add' mul' (f a) (f b) (F t) (images hidden) (FF last).
Proof.
  unfold bent_lmi. now rewrite (f_sum add add' f f_add), (f_band zero add mul zero' add' mul' f f_zero f_add f_mul),
    (f_scale_all mul mul' f f_mul), f_bends, map_length, f_weighted.
Qed.
Lemma f_repeat a n : F (repeat a n) = repeat (f a) n.
Proof. induction n; simpl; congruence. Qed.
Lemma f_fitted n u : F (fitted zero add n u) = fitted zero' add' n (F u).
Proof. unfold fitted. now rewrite <- firstn_map, (f_plus add add' f f_add), f_repeat, f_zero. Qed.
Lemma f_sum_rows a inputs before n k m :
  FF (sum_rows zero add a inputs before n k m) = sum_rows zero' add' (f a) inputs before n k (FF m).
Proof.
  revert before m. induction n as [|n IH]; intros before m; simpl; auto.
  rewrite IH, !map_app, !f_repeat, f_fitted, f_zero, skipn_map, firstn_map. do 3 f_equal.
  induction (firstn k m) as [|r rows IHr]; simpl; auto. now rewrite (f_plus add add' f f_add), IHr.
Qed.
Definition images_of_pins := map (fun p : pin => (F (fst (fst p)), FF (snd (fst p)), snd p)).
Lemma f_pins n ps : FF (pins zero add mul n ps) = pins zero' add' mul' n (images_of_pins ps).
Proof.
  revert n. induction ps as [|[[s rows] w] ps IH]; intros n; simpl; auto.
  rewrite (f_sum add add' f f_add), f_weighted_gram, (f_columns zero zero' f f_zero), map_app, IH. do 2 f_equal.
  induction n; simpl; congruence.
Qed.
End Morphism.

Open Scope R_scope.
Notation pinsR := (pins 0 Rplus Rmult).
Notation sum_rowsR := (sum_rows 0 Rplus).
Notation weighted_gramR := (weighted_gram 0 Rplus Rmult).
Notation bendsR := (bends 0 Rplus Rmult).
Notation bent_lmiR := (bent_lmi 0 Rplus Rmult).

Lemma form_weighted_gram s m z :
  form (weighted_gramR s m) z = dotR (combine_rows z m) (timesR s (combine_rows z m)).
Proof.
  revert z. induction m as [|r m IH]; intros [|a z]; simpl; auto.
  set (c := combine_rows z m) in *.
  assert (dotR (map (dotR (timesR s r)) m) z = dotR c (timesR s r)) as ->.
  { unfold c. rewrite dot_combine, dot_comm. f_equal. unfold apply. apply map_ext. intros. apply dot_comm. }
  assert (forall u v, dotR u (timesR s v) = dotR (timesR s u) v) as D by (intros; symmetry; apply dot_times).
  set (p := plusR (scaleR a r) c).
  assert (forall u, dotR u p = a * dotR u r + dotR u c) as P
    by (intros; unfold p; now rewrite dot_plus_r, dot_scale_r).
  assert (forall u, dotR (timesR s p) u = a * dotR (timesR s u) r + dotR (timesR s u) c) as Q
    by (intros; now rewrite <- D, dot_comm, P).
  rewrite IH. fold c. rewrite (D p p), P, !Q, (dot_comm (timesR s r) c), <- (D c r), (D c c). ring.
Qed.
(** z' m' diag(s) m z. *)
Lemma form_bend s m z :
  form (weighted_gramR s (columnsR (length z) m)) z = dotR (applyR m z) (timesR s (applyR m z)).
Proof.
  rewrite form_weighted_gram. set (l := combine_rows z _).
  assert (forall w, dotR l w = dotR w (applyR m z)) as H by (intros; unfold l; now rewrite dot_combine, dot_columns).
  rewrite H, dot_times, H. apply dot_comm.
Qed.
Lemma length_weighted_gram s m : length (weighted_gramR s m) = length m.
Proof. induction m; simpl; auto. Qed.
(** Upper rows without entries beyond the diagonal block. *)
Lemma form_weighted_gram_app s m rest z z' : length m = length z ->
  form (weighted_gramR s m ++ rest) (z ++ z') = form (weighted_gramR s m) z + form rest z'.
Proof.
  revert z. induction m as [|r m IH]; intros [|a z]; simpl; try discriminate; intros H; [ring|].
  rewrite IH, dot_app_short by (rewrite ?map_length; lia). ring.
Qed.

(** A hidden layer with what the matrix takes of it. *)
Definition bent_as (k : (list R -> list R) * layer) (b : @bent_layer R) :=
  bias_fits (snd k) /\ snd b = weights k /\ fits (weights k) (multipliers_of b).

(** The ranges and multipliers that belong to what is known of a layer. *)
Definition covers (r : relation R) (b : @bent_layer R) : Prop :=
  match r with
  | Each ranges => ranges_of b = ranges
  | Grouped n k => ranges_of b = repeat (-1, 1) (n * k) /\ exists t, multipliers_of b = spread k t /\ length t = n
      /\ Forall (Rle 0) t
  end.
Lemma times_repeat a n u : length u = n -> timesR u (repeat a n) = scaleR a u.
Proof. revert u. induction n as [|n IH]; intros [|b u]; simpl; try discriminate; auto. intros. rewrite IH by lia.
  f_equal. ring. Qed.
Lemma repeat_times_zeros n u : timesR (repeat 0 n) u = repeat 0 (Nat.min n (length u)).
Proof. revert u. induction n as [|n IH]; intros [|b u]; simpl; auto. now rewrite IH, Rmult_0_l. Qed.
Lemma times_zeros u n : timesR u (repeat 0 n) = repeat 0 (Nat.min (length u) n).
Proof. revert n. induction u as [|a u IH]; intros [|n]; simpl; auto. now rewrite IH, Rmult_0_r. Qed.
Lemma related_constraint r b y y' z z' : related r y y' z z' -> covers r b -> Forall (Rle 0) (multipliers_of b) ->
  let dz := minus z z' in let dy := minus y y' in let t := multipliers_of b in
  dotR dz (timesR t dz) <= dotR dz (timesR t (timesR (sums Rplus (ranges_of b)) dy))
    - dotR dy (timesR (timesR t (products Rmult (ranges_of b))) dy).
Proof.
  destruct b as [[ranges t] m], r as [r|n k]; cbn [related covers]; unfold ranges_of, multipliers_of; cbn [fst snd].
  - intros H -> Ht. now apply increments_constraint.
  - intros [_ H] [-> (l & -> & L & Hl)] _. cbv zeta. set (dy := minus y y') in *. set (dz := minus z z') in *.
    assert (sums Rplus (repeat (-1, 1) (n * k)) = repeat 0 (n * k)) as ->.
    { unfold sums. induction (n * k)%nat as [|i IH]; simpl; auto. rewrite IH. f_equal. ring. }
    assert (products Rmult (repeat (-1, 1) (n * k)) = repeat (-1) (n * k)) as ->.
    { unfold products. induction (n * k)%nat as [|i IH]; simpl; auto. rewrite IH. f_equal. ring. }
    rewrite times_repeat by now rewrite length_spread, L. rewrite times_scale, dot_scale_r, repeat_times_zeros,
      times_zeros.
    rewrite dot_comm with (u := dz) (v := repeat 0 _), dot_zeros.
    pose proof (groups_constraint n k l dy dz H L Hl). lra.
Qed.

(** How far apart the numbers that leave each hidden layer are. *)
Fixpoint steps (hidden : list ((list R -> list R) * layer)) (h h' : list R) : list R :=
  match hidden with
  | [] => []
  | (f, (m, b)) :: hidden' =>
      let z := f (affine m b h) in let z' := f (affine m b h') in minus z z' ++ steps hidden' z z'
  end.

(** From h, h' on. *)
Lemma bent_layers t hidden rs bs last b h h' :
  length t = length h -> length h' = length h -> length b = length last -> Forall2 bent_as hidden bs ->
  Forall2 covers rs bs -> along hidden rs h h' ->
  let dz := minus h h' in
  form (bent_lmiR 2 (-1) t bs last) (dz ++ steps hidden h h') <=
    2 * dotR dz (timesR t dz) - square (minus (network hidden (last, b) h) (network hidden (last, b) h')).
Proof.
  simpl. intros Ht Hh Hb H. revert t rs h h' Ht Hh. unfold bent_lmi.
  induction H as [|[f [m c]] [[r t2] m2] hidden bs (Hc & E & Ht2 & Hp2) H IH]; intros t rs h h' Ht Hh Hrs Hal.
  - cbn [steps]. rewrite app_nil_r, form_sum, form_scale. simpl. rewrite form_sum, form_scale, minus_affine by auto.
    assert (length (minus h h') = length t) as <- by (rewrite length_minus; auto).
    rewrite form_gram_columns, form_diagonal by (unfold scale; rewrite map_length, length_minus; auto).
    rewrite times_scale, dot_scale_r. lra.
  - inversion Hrs as [|rel ? rs' ? Hrel Hrs']; subst. unfold bias_fits, weights, multipliers_of in *. simpl in *.
    subst m2. destruct Hal as [Hf Hal].
    set (y := affine m c h) in *. set (y' := affine m c h') in *.
    assert (length y = length m) as Hy by (unfold y; now apply length_affine).
    set (z := f y) in *. set (z' := f y') in *. destruct (related_lengths _ _ _ _ _ Hf) as (_ & Lz & Lz').
    assert (length z = length m) as Hz by congruence. assert (length z' = length m) as Hz' by congruence.
    pose proof (IH t2 rs' z z' ltac:(congruence) ltac:(congruence) Hrs' Hal) as Hrest.
    assert (length r = length m) as Lr.
    { destruct rel as [ranges|n k]; cbn [related covers] in Hf, Hrel.
      - unfold ranges_of in Hrel. simpl in Hrel. subst ranges. destruct (increments_lengths _ _ _ _ _ Hf) as (? & _).
        congruence.
      - unfold ranges_of in Hrel. simpl in Hrel. destruct Hrel as [-> _]. destruct Hf as [(? & _) _].
        rewrite repeat_length. congruence. }
    assert (length (scale_rowsR (sums Rplus r) m) = length m) as Lw
      by (apply length_scale_rows; unfold sums; rewrite map_length; congruence).
    unfold multipliers_of, ranges_of. cbn [fst snd].
    rewrite form_sum, form_scale in Hrest |- *.
    assert (length (minus h h') = length t) as L by (rewrite length_minus; auto).
    rewrite <- L, form_block by (unfold scale; rewrite ?map_length, ?length_columns; auto).
    rewrite form_weighted_gram_app by apply length_columns. rewrite form_bend.
    rewrite dot_columns, (dot_comm (_ ++ _)), dot_app_short
      by (rewrite length_minus by congruence; unfold apply, scale_all;
          rewrite !map_length, length_scale_rows by congruence; lia).
    rewrite apply_scale_all, !apply_scale_rows, dot_scale_l, (dot_comm _ (minus z z')), !times_scale, !dot_scale_r.
    pose proof (related_constraint rel (r, t2, m) y y' z z' Hf Hrel Hp2) as C. cbv zeta in C.
    unfold ranges_of, multipliers_of in C. cbn [fst snd] in C. unfold y, y' in C. rewrite minus_affine in C by auto.
      lra.
Qed.

(** Rows that vanish, layer by layer. *)
Fixpoint pinned (hidden : list ((list R -> list R) * layer)) (ps : list (@pin R)) (h h' : list R) : Prop :=
  match hidden, ps with
  | (f, (m, b)) :: hidden', (s, rows, width) :: ps' =>
      let z := f (affine m b h) in let z' := f (affine m b h') in
      (length z = width /\ length z' = width) /\ Forall (fun r => dotR r (minus h h' ++ minus z z') = 0) rows
      /\ pinned hidden' ps' z z'
  | [], [] => True
  | _, _ => False
  end.
Lemma form_behind n p u v : length u = n -> form (repeat [] n ++ p) (u ++ v) = form p v.
Proof.
  revert u. induction n as [|n IH]; intros [|a u]; simpl; try discriminate; auto. intros. rewrite IH by lia. ring.
Qed.
Lemma pins_vanish hidden ps h h' : length h' = length h -> pinned hidden ps h h' ->
  form (pinsR (length h) ps) (minus h h' ++ steps hidden h h') = 0.
Proof.
  revert ps h h'. induction hidden as [|[f [m b]] hidden IH]; intros [|[[s rows] w] ps] h h' L H; cbn in H |- *;
    try contradiction; auto.
  destruct H as ([Lz Lz'] & Z & H). set (z := f (affine m b h)) in *. set (z' := f (affine m b h')) in *.
  assert (length (minus h h') = length h) as Ld by (rewrite length_minus; auto).
  rewrite form_sum, form_behind by auto. rewrite app_assoc, <- (app_nil_r (weighted_gramR _ _)).
  assert (length (minus h h' ++ minus z z') = (length h + w)%nat) as Lv
    by (rewrite app_length, Ld, length_minus; congruence).
  rewrite form_weighted_gram_app by now rewrite length_columns. rewrite <- Lv, form_bend.
  assert (applyR rows (minus h h' ++ minus z z') = repeat 0 (length rows)) as ->.
  { unfold apply. induction Z as [|r rows E Z IHr]; simpl; auto. now rewrite E, IHr. }
  rewrite dot_zeros. subst w. rewrite IH by (auto; congruence). simpl. ring.
Qed.

Lemma bent_bound rho n hidden rs bs last b x x' : bias_fits (last, b) -> Forall2 bent_as hidden bs ->
  Forall2 covers rs bs -> along hidden rs x x' -> length x = n -> length x' = n ->
  0 <= form (bent_lmiR 2 (-1) (repeat (rho / 2) n) bs last) (minus x x' ++ steps hidden x x') ->
  square (minus (network hidden (last, b) x) (network hidden (last, b) x')) <= rho * square (minus x x').
Proof.
  intros Hb H Hrs Hal Hx Hx' HP.
  assert (length (repeat (rho / 2) n) = length x) as Lt by now rewrite repeat_length.
  pose proof (bent_layers (repeat (rho / 2) n) hidden rs bs last b x x' Lt ltac:(congruence) Hb H Hrs Hal) as G.
  cbv zeta in G. set (d := minus x x') in *.
  assert (length d = n) as L by (unfold d; rewrite length_minus; congruence).
  assert (2 * dotR d (timesR (repeat (rho / 2) n) d) = rho * square d) as Q; [|lra].
  rewrite <- L. unfold square. clear. induction d as [|a d IH]; simpl; [ring|]. nra.
Qed.
Theorem bent_lmi_bounds rho n hidden rs bs last b x x' : bias_fits (last, b) -> Forall2 bent_as hidden bs ->
  Forall2 covers rs bs -> along hidden rs x x' -> length x = n -> length x' = n ->
  nonnegative (bent_lmiR 2 (-1) (repeat (rho / 2) n) bs last) ->
  square (minus (network hidden (last, b) x) (network hidden (last, b) x')) <= rho * square (minus x x').
Proof. intros. eapply bent_bound; eauto. Qed.
Theorem pinned_lmi_bounds rho n hidden rs bs ps last b x x' : bias_fits (last, b) -> Forall2 bent_as hidden bs ->
  Forall2 covers rs bs -> along hidden rs x x' -> pinned hidden ps x x' -> length x = n -> length x' = n ->
  nonnegative (sumR (bent_lmiR 2 (-1) (repeat (rho / 2) n) bs last) (pinsR n ps)) ->
  square (minus (network hidden (last, b) x) (network hidden (last, b) x')) <= rho * square (minus x x').
Proof.
  intros Hb H Hrs Hal Hp Hx Hx' HP. eapply bent_bound; eauto.
  specialize (HP (minus x x' ++ steps hidden x x')). rewrite form_sum in HP.
  assert (form (pinsR n ps) (minus x x' ++ steps hidden x x') = 0) as E; [|lra].
  rewrite <- Hx. apply pins_vanish; congruence.
Qed.

(** The sums of groups, as these rows. *)
Lemma dot_fitted n u v : length v = n -> dotR (fitted 0 Rplus n u) v = dotR u v.
Proof.
  unfold fitted. revert u v. induction n as [|n IH]; intros u [|b v]; simpl; try discriminate; intros H.
  - now rewrite dot_nil_r.
  - destruct u as [|a u]; simpl; rewrite <- ?(IH u v ltac:(lia)), <- ?(IH [] v ltac:(lia)).
    + simpl. assert (plusR [] (repeat 0 n) = repeat 0 n) as <- by reflexivity. rewrite (IH [] v) by lia. simpl. ring.
    + ring.
Qed.
Lemma length_fitted n u : length (fitted 0 Rplus n u) = n.
Proof.
  unfold fitted. apply firstn_length_le. revert u. induction n as [|n IH]; intros [|a u]; simpl; try lia;
    [now rewrite repeat_length|]. specialize (IH u). lia.
Qed.
Lemma dot_sum_of_rows rows v : dotR (fold_right plusR [] rows) v = total (applyR rows v).
Proof. induction rows as [|r rows IH]; simpl; auto. now rewrite dot_plus_l, IH. Qed.
Lemma dot_minus_ones k u : length u = k -> dotR (repeat (-1) k) u = - total u.
Proof. revert u. induction k as [|k IH]; intros [|a u]; simpl; try discriminate; intros; [ring|]. rewrite IH by lia.
  ring. Qed.
Lemma sum_rows_vanish n k m dh before dz : groups_within n k (applyR m dh) dz ->
  Forall (fun r => dotR r (dh ++ before ++ dz) = 0) (sum_rowsR (-1) (length dh) (length before) n k m).
Proof.
  revert m before dz. induction n as [|n IH]; intros m before dz; simpl; [constructor|].
  intros (Ly & Lz & _ & S & H). constructor.
  - rewrite dot_app by now rewrite length_fitted. rewrite dot_fitted, dot_sum_of_rows by auto.
    rewrite dot_app by now rewrite repeat_length. rewrite dot_zeros.
    rewrite <- (firstn_skipn k dz). rewrite dot_app_short by (rewrite repeat_length; lia).
    rewrite dot_minus_ones by auto. rewrite S. unfold apply. rewrite firstn_map. ring.
  - specialize (IH (skipn k m) (before ++ firstn k dz) (skipn k dz)). rewrite app_length, Lz in IH.
    rewrite <- app_assoc, firstn_skipn in IH. apply IH. unfold apply in *. now rewrite <- skipn_map.
Qed.
