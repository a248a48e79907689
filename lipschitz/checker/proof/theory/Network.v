(** Networks over the reals, and what a nonnegative form says about those whose activations have bounded slopes. *)
From Coq Require Import List Reals Lra Lia Psatz.
From Swarmcert Require Import Algebra Activations Form.
Import ListNotations.
Open Scope R_scope.

Notation matrix := (list (list R)).
(** Weights by rows, biases. *)
Notation layer := (matrix * list R)%type.
Definition affine (m : matrix) (b x : list R) : list R := plusR (applyR m x) b.
(** Each hidden layer with the function that follows it. *)
Fixpoint network (hidden : list ((list R -> list R) * layer)) (last : layer) (x : list R) : list R :=
  match hidden with
  | [] => affine (fst last) (snd last) x
  | (f, (m, b)) :: hidden' => network hidden' last (f (affine m b x))
  end.
Definition bias_fits (l : layer) := length (snd l) = length (fst l).
Definition weights (k : (list R -> list R) * layer) : matrix := fst (snd k).
Definition norm (u : list R) := sqrt (square u).

(** What the inequality rests on: between the numbers of y and y', where those of z and z' belong to them, slopes lie in
    a range [a, b] for each. *)
Notation range := (R * R)%type.
Definition increment_within (r : range) (y y' z z' : R) : Prop :=
  0 <= (z - z' - fst r * (y - y')) * (snd r * (y - y') - (z - z')).
Fixpoint increments_within (ranges : list range) (y y' z z' : list R) : Prop :=
  match ranges, y, y', z, z' with
  | r :: ranges', u :: v, u' :: v', w :: x, w' :: x' =>
      increment_within r u u' w w' /\ increments_within ranges' v v' x x'
  | [], [], [], [], [] => True
  | _, _, _, _, _ => False
  end.
(** Of n groups of k numbers each: a group comes no further apart than what enters it, and keeps its sum. *)
Definition total (u : list R) : R := fold_right Rplus 0 u.
Fixpoint groups_within (n k : nat) (dy dz : list R) : Prop :=
  match n with
  | O => dy = [] /\ dz = []
  | S n' =>
      length (firstn k dy) = k /\ length (firstn k dz) = k /\ square (firstn k dz) <= square (firstn k dy)
      /\ total (firstn k dz) = total (firstn k dy) /\ groups_within n' k (skipn k dy) (skipn k dz)
  end.
(** What is known of a layer: of each number by itself, or of n groups of k. *)
Inductive relation {T : Type} := Each (ranges : list (T * T)) | Grouped (n k : nat).
Arguments relation : clear implicits.
Definition related (r : relation R) (y y' z z' : list R) : Prop :=
  match r with
  | Each ranges => increments_within ranges y y' z z'
  | Grouped n k => (length y = n * k /\ length y' = n * k /\ length z = n * k /\ length z' = n * k)%nat
      /\ groups_within n k (minus y y') (minus z z')
  end.
(** The same of all hidden layers, from what enters the first. *)
Fixpoint along (hidden : list ((list R -> list R) * layer)) (rs : list (relation R)) (h h' : list R) : Prop :=
  match hidden, rs with
  | (f, (m, b)) :: hidden', r :: rs' =>
      let y := affine m b h in let y' := affine m b h' in
      related r y y' (f y) (f y') /\ along hidden' rs' (f y) (f y')
  | [], [] => True
  | _, _ => False
  end.
Definition unit_range (r : range) := r = (0, 1).
Definition unit_relation (r : relation R) := match r with Each ranges => Forall unit_range ranges | _ => False end.

Lemma minus_affine m b x x' : length b = length m -> minus (affine m b x) (affine m b x') = applyR m (minus x x').
Proof.
  intros H. rewrite apply_minus. unfold affine, minus.
  assert (forall u v w, length u = length w -> length v = length w ->
    plusR (plusR u w) (scaleR (-1) (plusR v w)) = plusR u (scaleR (-1) v)) as E.
  { clear. induction u as [|a u IH]; intros [|b v] [|c w]; simpl; try discriminate; intros; auto.
    rewrite IH by lia. f_equal. ring. }
  apply E; unfold apply; rewrite map_length; auto.
Qed.
Lemma length_affine m b x : length b = length m -> length (affine m b x) = length m.
Proof.
  unfold affine, apply. revert b. induction m as [|r m IH]; intros [|c b]; simpl; try discriminate; auto.
Qed.
Lemma length_minus u v : length v = length u -> length (minus u v) = length u.
Proof. unfold minus. revert v. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; auto. Qed.

Lemma slope_increment f r u u' : slopes f (fst r) (snd r) -> increment_within r u u' (f u) (f u').
Proof.
  intros S. unfold increment_within. destruct (Rle_dec u u'); [specialize (S u u')|specialize (S u' u)]; nra.
Qed.
Lemma increments_lengths r y y' z z' : increments_within r y y' z z' ->
  length y = length r /\ length y' = length r /\ length z = length r /\ length z' = length r.
Proof.
  revert y y' z z'. induction r as [|a r IH]; intros [|u y] [|u' y'] [|w z] [|w' z']; simpl; try tauto.
  intros [_ H]. destruct (IH y y' z z' H) as (? & ? & ? & ?). repeat split; lia.
Qed.
Lemma related_lengths r y y' z z' : related r y y' z z' ->
  length y' = length y /\ length z = length y /\ length z' = length y.
Proof.
  destruct r as [r|n k]; simpl.
  - intros H. apply increments_lengths in H. intuition congruence.
  - intuition congruence.
Qed.
Lemma increments_app r s y y' z z' v v' w w' : increments_within r y y' z z' -> increments_within s v v' w w' ->
  increments_within (r ++ s) (y ++ v) (y' ++ v') (z ++ w) (z' ++ w').
Proof.
  intros H G. revert y y' z z' H. induction r as [|a r IH]; intros [|u y] [|u' y'] [|t z] [|t' z']; simpl; try tauto.
  intros [I H]. split; auto.
Qed.

(** dz ((a + b) dy - dz) - a b dy^2 >= 0, with multipliers. *)
Definition sums_of (r : list range) := map (fun i => fst i + snd i) r.
Definition products_of (r : list range) := map (fun i => fst i * snd i) r.
Lemma increments_constraint r t y y' z z' : increments_within r y y' z z' -> Forall (Rle 0) t ->
  let dz := minus z z' in let dy := minus y y' in
  dotR dz (timesR t dz) <= dotR dz (timesR t (timesR (sums_of r) dy)) - dotR dy (timesR (timesR t (products_of r)) dy).
Proof.
  simpl. unfold minus. intros H Ht. revert r y y' z z' H.
  induction Ht as [|c t Hc Ht IH]; intros [|[a b] r] [|u y] [|u' y'] [|w z] [|w' z']; simpl; try tauto; try lra.
  intros [S H]. specialize (IH r y y' z z' H). pose proof (Rmult_le_pos _ _ Hc S). simpl in *. nra.
Qed.
Lemma slope_constraint r t y y' z z' : increments_within r y y' z z' -> Forall unit_range r -> Forall (Rle 0) t ->
  let dz := minus z z' in dotR dz (timesR t dz) <= dotR dz (timesR t (minus y y')).
Proof.
  simpl. unfold minus. intros H U Ht. revert r y y' z z' H U.
  induction Ht as [|c t Hc Ht IH]; intros [|[a b] r] [|u y] [|u' y'] [|w z] [|w' z']; simpl; try tauto; try lra.
  intros [S H] U. inversion U as [|? ? E U']; subst. inversion E; subst. specialize (IH r y y' z z' H U').
  pose proof (Rmult_le_pos _ _ Hc S). simpl in *. nra.
Qed.

Lemma unit_constraint r t y y' z z' : related r y y' z z' -> unit_relation r -> Forall (Rle 0) t ->
  let dz := minus z z' in dotR dz (timesR t dz) <= dotR dz (timesR t (minus y y')).
Proof. destruct r as [r|n k]; simpl; [apply slope_constraint|tauto]. Qed.

(** In groups, with one multiplier for each. *)
Definition spread {T} (k : nat) (t : list T) : list T := flat_map (fun a => repeat a k) t.
Lemma length_spread {T} k (t : list T) : length (spread k t) = (length t * k)%nat.
Proof. unfold spread. induction t as [|a t IH]; simpl; auto. now rewrite app_length, repeat_length, IH. Qed.
Lemma spread_nonnegative k t : Forall (Rle 0) t -> Forall (Rle 0) (spread k t).
Proof.
  intros H. induction H as [|a t Ha H IH]; simpl; [constructor|]. apply Forall_app. split; auto.
  apply Forall_forall. intros b Hb. apply repeat_spec in Hb. now subst.
Qed.
Lemma dot_repeat a k u : length u = k -> dotR u (timesR (repeat a k) u) = a * square u.
Proof.
  unfold square. revert u. induction k as [|k IH]; intros [|b u]; simpl; try discriminate; intros H; [ring|].
  rewrite IH by lia. ring.
Qed.
Lemma dot_times_app (u v t w : list R) : length t = length u ->
  dotR (u ++ v) (timesR (t ++ w) (u ++ v)) = dotR u (timesR t u) + dotR v (timesR w v).
Proof.
  revert t. induction u as [|a u IH]; intros [|b t]; simpl; try discriminate; intros H; [ring|]. rewrite IH by lia.
    ring.
Qed.
Lemma groups_constraint n k t dy dz : groups_within n k dy dz -> length t = n -> Forall (Rle 0) t ->
  dotR dz (timesR (spread k t) dz) <= dotR dy (timesR (spread k t) dy).
Proof.
  revert t dy dz. induction n as [|n IH]; intros [|a t] dy dz; simpl; try discriminate; intros H L F.
  - destruct H as [-> ->]. simpl. lra.
  - destruct H as (Ly & Lz & Q & _ & H). inversion F as [|? ? Ha F']; subst.
    specialize (IH t _ _ H ltac:(lia) F'). rewrite <- (firstn_skipn k dy), <- (firstn_skipn k dz).
    rewrite !dot_times_app by (rewrite repeat_length; lia). rewrite !dot_repeat by auto.
    pose proof (Rmult_le_compat_l _ _ _ Ha Q). lra.
Qed.

Definition fits (m : matrix) (t : list R) := length t = length m /\ Forall (Rle 0) t.

Lemma times_scale a v w : timesR (scaleR a v) w = scaleR a (timesR v w).
Proof. revert w. induction v as [|b v IH]; intros [|c w]; simpl; auto. rewrite IH. f_equal. ring. Qed.
Lemma length_columns n m : length (columnsR n m) = n.
Proof. revert m. induction n; simpl; auto. Qed.
Lemma length_scale_rows t m : length t = length m -> length (scale_rowsR t m) = length m.
Proof. revert m. induction t as [|a t IH]; intros [|r m]; simpl; try discriminate; auto. Qed.

(** From the first hidden layer's activations h, h' on. *)
Lemma later_layers rho t hidden ranges ts last b h h' :
  0 < rho -> length t = length h -> length h' = length h -> length b = length last ->
  Forall (fun k => bias_fits (snd k)) hidden -> along hidden ranges h h' -> Forall unit_relation ranges ->
  Forall2 fits (map weights hidden) ts ->
  let dz := minus h h' in
  exists rest, form (bandR (2 * rho) (- rho) t (List.combine ts (map weights hidden)) last) (dz ++ rest) <=
    2 * rho * dotR dz (timesR t dz) - rho * square (minus (network hidden (last, b) h) (network hidden (last, b) h')).
Proof.
  simpl. intros Hr. revert t ranges ts h h'.
  induction hidden as [|[f [m c]] hidden IH]; intros t ranges ts h h' Ht Hh Hb Hbs Hal U Hts.
  - exists []. inversion Hts; subst. simpl. rewrite app_nil_r, form_sum, form_scale, minus_affine by auto.
    assert (length (minus h h') = length t) as <- by (rewrite length_minus; auto).
    rewrite form_gram_columns, form_diagonal by (unfold scale; rewrite map_length, length_minus; auto).
    apply Req_le. unfold Rminus. f_equal; [|ring].
    now rewrite times_scale, dot_scale_r.
  - destruct ranges as [|r ranges]; [contradiction|]. destruct Hal as [Hf Hal].
    inversion Hbs as [|? ? Hc Hbs']; inversion Hts as [|? t2 ? ts' [Ht2 Hp2] Hts']; inversion U as [|? ? U1 U2]; subst.
    unfold bias_fits, weights in *. simpl in *.
    set (z := f (affine m c h)) in *. set (z' := f (affine m c h')) in *.
    destruct (related_lengths _ _ _ _ _ Hf) as (_ & Lz & Lz'). rewrite length_affine in Lz, Lz' by auto.
    assert (length z = length m) as Hz by congruence. assert (length z' = length m) as Hz' by congruence.
    destruct (IH t2 ranges ts' z z') as [rest Hrest]; try congruence; auto.
    exists (minus z z' ++ rest).
    assert (length (minus h h') = length t) as L by (rewrite length_minus; auto).
    rewrite <- L, form_block by (unfold scale; rewrite ?map_length, ?length_columns; auto).
    rewrite dot_columns, (dot_comm (_ ++ _)), dot_app_short
      by (rewrite length_minus by congruence; unfold apply, scale_all; rewrite !map_length, length_scale_rows; lia).
    rewrite apply_scale_all, apply_scale_rows, dot_scale_l, (dot_comm _ (minus z z')), times_scale, dot_scale_r.
    pose proof (unit_constraint r t2 _ _ _ _ Hf U1 Hp2) as C.
    cbv zeta in C. rewrite minus_affine in C by auto. simpl in C. nra.
Qed.

(** Completes the square rho^2 |dx|^2 - 2 rho l dx + |l|^2. *)
Lemma completed_square rho l x : 2 * rho * dotR l x - square l <= rho * rho * square x.
Proof.
  pose proof (square_nonneg (minus (scaleR rho x) l)) as H. unfold square, minus in *.
  rewrite !dot_plus_l, !dot_plus_r in H. repeat rewrite ?dot_scale_l, ?dot_scale_r in H. rewrite (dot_comm x l) in
      H. nra.
Qed.

Theorem lmi_bounds rho t f first b1 hidden r ranges ts last b x x' :
  0 < rho -> bias_fits (first, b1) -> Forall (fun k => bias_fits (snd k)) hidden -> bias_fits (last, b) ->
  along ((f, (first, b1)) :: hidden) (r :: ranges) x x' -> Forall unit_relation (r :: ranges) ->
  fits first t -> Forall2 fits (map weights hidden) ts ->
  nonnegative (lmi 0 Rplus Rmult (-1) (2 * rho) (- rho) t first (List.combine ts (map weights hidden)) last) ->
  let g := network ((f, (first, b1)) :: hidden) (last, b) in
  square (minus (g x) (g x')) <= rho * square (minus x x').
Proof.
  intros Hr H1 Hh Hl [Hf Hal] U [Ht Hp] Hts HP. inversion U as [|? ? U1 U2]; subst. simpl. unfold bias_fits in *.
  simpl in *. set (z := f (affine first b1 x)) in *. set (z' := f (affine first b1 x')) in *.
  destruct (related_lengths _ _ _ _ _ Hf) as (_ & Lz & Lz'). rewrite length_affine in Lz, Lz' by auto.
  assert (length z = length first) as Hz by congruence. assert (length z' = length first) as Hz' by congruence.
  destruct (later_layers rho t hidden ranges ts last b z z') as [rest Hrest]; try congruence; auto.
  pose proof (unit_constraint r t _ _ _ _ Hf U1 Hp) as C.
  cbv zeta in C. rewrite minus_affine in C by auto.
  specialize (HP (minus z z' ++ rest)). unfold lmi in HP. rewrite form_sum, form_scale, form_gram in HP.
  set (l := combine_rows _ _) in HP.
  assert (dotR l (minus x x') = dotR (minus z z') (timesR t (applyR first (minus x x')))) as E.
  { unfold l. rewrite dot_combine, apply_scale_rows, dot_comm, dot_app_short, dot_comm; auto.
    rewrite length_minus by congruence. rewrite <- (apply_scale_rows t first).
    unfold apply. rewrite map_length, length_scale_rows; lia. }
  pose proof (completed_square rho l (minus x x')). rewrite E in *.
  set (s := square (minus (network _ _ z) _)) in *.
  apply (Rmult_le_reg_l rho); auto. nra.
Qed.

(** No hidden layer. *)
Theorem norm_lmi_bounds rho m b : 0 < rho -> bias_fits (m, b) ->
  nonnegative (norm_lmi 0 Rplus Rmult (-1) rho m) -> forall x x',
  square (minus (network [] (m, b) x) (network [] (m, b) x')) <= rho * square (minus x x').
Proof.
  intros Hr H HP x x'. simpl. rewrite minus_affine by auto. set (y := applyR m (minus x x')).
  assert (length (map (fun _ => rho) m) = length y) as L by (unfold y, apply; now rewrite !map_length).
  specialize (HP y). unfold norm_lmi in HP. rewrite form_sum, form_scale, form_gram, form_diagonal in HP by auto.
  assert (timesR (map (fun _ => rho) m) y = scaleR rho y) as T.
  { unfold y. clear. induction m as [|r m IH]; simpl; auto. now rewrite IH. }
  rewrite T, dot_scale_r in HP. fold (square y) in HP.
  pose proof (completed_square rho (combine_rows y m) (minus x x')) as C.
  rewrite dot_combine in C. fold y in C. fold (square y) in C.
  apply (Rmult_le_reg_l rho); auto. nra.
Qed.

(** The same through m' m. *)
Theorem norm_lmi_columns_bounds rho m b n : 0 < rho -> bias_fits (m, b) ->
  nonnegative (norm_lmi 0 Rplus Rmult (-1) rho (columnsR n m)) ->
  forall x x', length x = n -> length x' = n ->
  square (minus (network [] (m, b) x) (network [] (m, b) x')) <= rho * square (minus x x').
Proof.
  intros Hr H HP x x' Hx Hx'. simpl. rewrite minus_affine by auto. set (d := minus x x').
  assert (length d = n) as L by (unfold d; rewrite length_minus; lia). clearbody d.
  specialize (HP d). unfold norm_lmi in HP.
  rewrite form_sum, form_scale, <- L, form_gram_columns, form_diagonal in
      HP by (now rewrite map_length, length_columns).
  assert (forall (m : matrix) (y : list R), length m = length y ->
      dotR y (timesR (map (fun _ => rho) m) y) = rho * square y) as T.
  { unfold square. clear. induction m as [|r m IH]; intros [|c y]; simpl; try discriminate; intros; [ring|].
    rewrite IH by lia. ring. }
  rewrite T in HP by (now rewrite length_columns). lra.
Qed.
